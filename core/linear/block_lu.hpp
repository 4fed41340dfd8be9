// Sparse LU factorisation of a general matrix of square blocks on the graph of bodies. It exchanges rows within the
// diagonal blocks only, so it serves matrices near a positive definite one. Its users check the solution. The
// constructor does the symbolic work (elimination.hpp). factor, solve and solve_transposed allocate nothing.
//
//   L_ik = A_ik inv(U_kk),   U_ki = inv(L_kk) A_ki,   A_ij -= L_ik U_kj
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "core/linear/elimination.hpp"
#include "core/linear/lu_kernels.hpp"

namespace mbsopt {

class BlockLu {
 public:
  // rows is the number of rows of a block: 7, 14, 21 or 28.
  BlockLu(int rows, int bodies, std::span<const std::pair<int, int>> edges,
          const LuKernelTable& kernels = lu_kernels());
  static bool takes(int rows) { return rows == 7 || rows == 14 || rows == 21 || rows == 28; }

  // The place of a block: of one body, or of two bodies that an edge joins.
  struct Handle {
    std::size_t offset = 0;
    bool transposed = false;  // whether it is stored transposed
  };
  Handle handle(int row_body, int column_body) const;

  void set_zero();
  // Adds X to the part of the block that begins at (row, column).
  template <class X>
  void add(const Handle& block, Eigen::Index row, Eigen::Index column, const X& x) {
    Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>> A(values_.data() + block.offset, rows_, rows_,
                                                           Eigen::OuterStride<>(stride_));
    constexpr int kRows = X::RowsAtCompileTime, kColumns = X::ColsAtCompileTime;
    if (block.transposed) {
      A.block<kColumns, kRows>(column, row) += x.transpose();
    } else {
      A.block<kRows, kColumns>(row, column) += x;
    }
  }

  bool factor();  // false where a pivot is zero or not a number

  // Solves in place. Column c of x holds body after body (0-based), stride() numbers each. The first rows() of them
  // count; the others are zero.
  void solve(Eigen::Ref<Eigen::MatrixXd> x) const;
  void solve_transposed(Eigen::Ref<Eigen::MatrixXd> x) const;
  Eigen::Index rows() const { return rows_; }
  Eigen::Index stride() const { return stride_; }

 private:
  template <bool Transposed>
  void solve_column(double* x) const;

  double* block(std::size_t k) { return values_.data() + k * size_; }
  const double* block(std::size_t k) const { return values_.data() + k * size_; }
  // k is the elimination position of a diagonal block.
  double* inverse_of(std::size_t k) { return inverse_.data() + k * static_cast<std::size_t>(rows_); }
  const double* inverse_of(std::size_t k) const { return inverse_.data() + k * static_cast<std::size_t>(rows_); }
  int* exchanged_of(std::size_t k) { return exchanged_.data() + k * static_cast<std::size_t>(rows_); }
  const int* exchanged_of(std::size_t k) const { return exchanged_.data() + k * static_cast<std::size_t>(rows_); }
  // Below the diagonal: A_ik, then L_ik. Above it, transposed: A_ki', then U_ki'.
  std::size_t lower(std::size_t entry) const { return elimination_.order.size() + 2 * entry; }
  std::size_t upper(std::size_t entry) const { return lower(entry) + 1; }

  Eigen::Index rows_, stride_;
  std::size_t size_;  // numbers per block
  const LuKernels* kernels_;
  Elimination elimination_;
  std::vector<double> values_;   // blocks, columns of stride_ numbers each
  std::vector<double> inverse_;  // of the pivots
  std::vector<int> exchanged_;   // per row of a diagonal block: with which
};

}  // namespace mbsopt
