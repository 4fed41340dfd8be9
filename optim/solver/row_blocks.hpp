// A matrix in blocks of rows, each with entries in a few columns only. Elimination solves its least-squares problem:
// columns of the same blocks leave the problem through the QR factors of their rows,
//
//   [ A  B | b ]  =  Q [ R  S | q ]          R d_A = q - S d_B
//                      [ 0  T | p ]          T d_B ~ p: a new block, which replaces these rows
//
// Columns of the fewest blocks come first. The cost is linear in the number of blocks if each has columns of its own,
// or shares them with its neighbours. Further columns may be common to all. One block with all columns is the usual QR
// factorisation. Bjorck, "Numerical Methods for Least Squares Problems" (1996), section 6.3; Duff and Reid, ACM
// Transactions on Mathematical Software 9 (1983) 302.
//
//   RowBlocks A({{{0, 2}, A_1}, {{1, 2}, A_2}}, 3);        // columns 0 and 1 in one block each, 2 in both
//   const VectorXd d = A.solve(b, {0, 1, 2});
#pragma once

#include <Eigen/Core>
#include <vector>

namespace mbsopt::inline optim {

struct RowBlock {
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd A;  // with these columns
};

class RowBlocks {
 public:
  RowBlocks(std::vector<RowBlock> blocks, Eigen::Index columns);
  RowBlocks(const Eigen::MatrixXd& A);  // one block

  Eigen::Index columns() const { return columns_; }
  const std::vector<RowBlock>& blocks() const { return blocks_; }

  // Vectors of rows hold those of the blocks, one below the other.
  Eigen::VectorXd operator*(const Eigen::VectorXd& d) const;
  Eigen::VectorXd transposed_times(const Eigen::VectorXd& b) const;
  Eigen::VectorXd column_norms() const;

  // Minimises |A d - b| over the free columns, which must be independent. The others of d are zero.
  Eigen::VectorXd solve(const Eigen::VectorXd& b, const std::vector<Eigen::Index>& free) const;

  // The matrix of |A D^-1 e|^2 + lambda |e|^2. The rows sqrt(lambda) e_k come last, one per column. Columns with the
  // same first block share a block of them, so that elimination still takes the same columns at once.
  RowBlocks scaled_and_damped(const Eigen::VectorXd& D, double lambda) const;

 private:
  std::vector<RowBlock> blocks_;
  Eigen::Index columns_;
  std::vector<std::vector<std::size_t>> places_;  // per column: the blocks with it
};

}  // namespace mbsopt::inline optim
