// Phi_eta of all constraints as blocks of two 6-rows each, and the products the formulations need of it. A row of Phi
// that several constraints share (a gear) has several blocks.
#pragma once

#include <vector>

#include "core/dynamics/block_cholesky.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class ConstraintRows {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

  explicit ConstraintRows(const MechanismData& data);

  void evaluate(const std::vector<Frame>& frames);  // J at the frames' positions

  // y += J x; x: 6 numbers (or lanes of them) per moving body, body i at x[i - 1].
  template <class X, class Y>
  void add_times(const std::vector<X>& x, Y& y) const {
    for (const RowGroup& g : data_->groups) {
      for (int r = 0; r < g.rows; ++r) {
        if (g.body1 > 0) add_row_times(J1, g.block + r, x[at(g.body1)], y, g.row + r);
        if (g.body2 > 0) add_row_times(J2, g.block + r, x[at(g.body2)], y, g.row + r);
      }
    }
  }
  // x -= J'lambda
  template <class X, class Y>
  void subtract_transposed_times(const Y& lambda, std::vector<X>& x) const {
    for (const RowGroup& g : data_->groups) {
      for (int r = 0; r < g.rows; ++r) {
        if (g.body1 > 0) subtract_row_times(J1, g.block + r, lambda, g.row + r, x[at(g.body1)]);
        if (g.body2 > 0) subtract_row_times(J2, g.block + r, lambda, g.row + r, x[at(g.body2)]);
      }
    }
  }
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky& S);

  Eigen::MatrixXd dense() const;  // J, 6 columns per moving body

  BlockCholesky matrix() const;  // a matrix with the pattern of J'J

  Rows J1, J2;  // one row per block row

 private:
  // Written out by rows: the compiler unrolls these, and does not unroll Eigen's products with a row of a dynamic
  // matrix.
  template <class X, class Y>
  static void add_row_times(const Rows& J, int block, const X& x, Y& y, int row) {
    for (int i = 0; i < 6; ++i) y.row(row) += J(block, i) * x.row(i);
  }
  template <class X, class Y>
  static void subtract_row_times(const Rows& J, int block, const Y& lambda, int row, X& x) {
    for (int i = 0; i < 6; ++i) x.row(i) -= J(block, i) * lambda.row(row);
  }
  static std::size_t at(int body) { return static_cast<std::size_t>(body - 1); }
  void add_shared_square(const Eigen::VectorXd& alpha, BlockCholesky& S);

  // A row with several constraints: its distinct moving bodies, and the off-diagonal blocks of their pairs.
  struct SharedRow {
    int row = 0;
    std::vector<int> bodies;
    std::vector<std::size_t> handles;  // of pairs (0,1), (0,2), (1,2), ...
    std::vector<Mat<1, 6>> J;          // per body
  };

  const MechanismData* data_;
  std::vector<std::size_t> handle_;  // per group: its off-diagonal block
  std::vector<SharedRow> shared_;
  std::vector<std::pair<int, int>> edges_;
};

}  // namespace mbsopt
