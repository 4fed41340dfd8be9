// Sparse Cholesky factorisation S = L D L' (D diagonal) of a symmetric positive definite matrix of N x N blocks on the
// graph of bodies, N = 6 in space, 3 in the plane. The constructor does the symbolic work (elimination order by AMD,
// fill). factor and solve allocate nothing.
//
//   BlockCholesky<6> S(bodies, edges);       // edges: pairs of bodies that share a block
//   S.set_zero();  S.diagonal(0) += ...;  S.add_off_diagonal(handle, X);
//   if (!S.factor()) ...                     // not positive definite
//   S.solve(x);                              // in place, N numbers per body; or lanes of several right-hand sides
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/linear/elimination.hpp"
#include "core/linear/fixed_size.hpp"
#include "core/linear/kernel_table.hpp"

namespace mbsopt {

template <int N>
class BlockCholesky {
 public:
  using Block = Mat<N, N>;

  BlockCholesky() = default;
  // Bodies 0..bodies-1. Handle k below belongs to edges[k]; repeated edges share a block.
  BlockCholesky(int bodies, std::span<const std::pair<int, int>> edges);

  void set_zero();
  void set_off_diagonals_to_zero();
  Block& diagonal(int body) { return diagonal_[at(elimination_.position[at(body)])]; }
  // Adds X to the block (first, second) of edge `handle` and its transpose to (second, first).
  void add_off_diagonal(std::size_t handle, const Block& X) {
    const Elimination::Place& h = handles_[handle];
    if (h.transposed) {
      lower_[h.block] += X.transpose();
    } else {
      lower_[h.block] += X;
    }
  }

  // The stored block of edge `handle`: (first, second), or (second, first) if it is transposed.
  Block& off_diagonal(std::size_t handle) { return lower_[handles_[handle].block]; }
  bool transposed(std::size_t handle) const { return handles_[handle].transposed; }

  bool factor();

  void solve(std::span<Vec<N>> x);
  void solve(std::span<Lanes<N>> x);

  std::size_t fill_blocks() const { return lower_.size(); }
  std::size_t blocks() const { return diagonal_.size() + lower_.size(); }

 private:
  FactorView view() const;

  Elimination elimination_;
  std::vector<int> first_block_, body_;    // per position, and after the last; per block: the body of its row
  std::vector<std::size_t> first_update_;  // per position, and after the last
  std::vector<Elimination::Update> updates_;
  std::vector<Elimination::Place> handles_;
  std::vector<Block> diagonal_, lower_;  // S before factor(), inv(L_kk) below the diagonal and L_ik after
  std::vector<Vec<N>> inverse_;          // of D
  std::vector<Block> scaled_;            // L_ik D_k of the present column
};
extern template class BlockCholesky<6>;
extern template class BlockCholesky<3>;

}  // namespace mbsopt
