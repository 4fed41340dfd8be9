// Phi_eta of all constraints as rows with two 6-blocks each, and the products the formulations need of it.
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
      for (int r = g.row; r < g.row + g.rows; ++r) {
        if (g.body1 > 0) add_row_times(J1, r, x[at(g.body1)], y);
        if (g.body2 > 0) add_row_times(J2, r, x[at(g.body2)], y);
      }
    }
  }
  // x -= J'lambda
  template <class X, class Y>
  void subtract_transposed_times(const Y& lambda, std::vector<X>& x) const {
    for (const RowGroup& g : data_->groups) {
      for (int r = g.row; r < g.row + g.rows; ++r) {
        if (g.body1 > 0) subtract_row_times(J1, r, lambda, x[at(g.body1)]);
        if (g.body2 > 0) subtract_row_times(J2, r, lambda, x[at(g.body2)]);
      }
    }
  }
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky& S) const;

  BlockCholesky matrix() const;  // a matrix with the pattern of J'J

  Rows J1, J2;

 private:
  // Written out by rows: the compiler unrolls these, and does not unroll Eigen's products with a row of a dynamic
  // matrix.
  template <class X, class Y>
  static void add_row_times(const Rows& J, int r, const X& x, Y& y) {
    for (int i = 0; i < 6; ++i) y.row(r) += J(r, i) * x.row(i);
  }
  template <class X, class Y>
  static void subtract_row_times(const Rows& J, int r, const Y& lambda, X& x) {
    for (int i = 0; i < 6; ++i) x.row(i) -= J(r, i) * lambda.row(r);
  }
  static std::size_t at(int body) { return static_cast<std::size_t>(body - 1); }

  const MechanismData* data_;
  std::vector<std::size_t> handle_;  // per group: its off-diagonal block
};

}  // namespace mbsopt
