// Phi_eta of all constraints as blocks of two 6-rows each, and the products the formulations need of it. A row of Phi
// that several constraints share (a gear) has several blocks.
#pragma once

#include <algorithm>
#include <vector>

#include "core/dynamics/block_cholesky.hpp"
#include "core/dynamics/pairs.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class ConstraintRows {
 public:
  static constexpr int kUnknowns = 6;  // per body
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  using Frames = std::vector<Frame>;

  explicit ConstraintRows(const MechanismData& data);

  void evaluate(const std::vector<Frame>& frames);  // J at the frames' positions

  // y += J x; x: 6 numbers (or lanes of them) per moving body, body i at x[i - 1].
  void add_times(const std::vector<Vec<6>>& x, Eigen::VectorXd& y) const {
    for (const RowGroup& g : data_->groups) {
      if (g.body1 > 0 && g.body2 > 0) {
        const Column<3> x1(x[at(g.body1)].data()), x2(x[at(g.body2)].data());
        for (int r = 0; r < g.rows; ++r) {
          const Pair sum = x1.times(row(J1, g.block + r)) + x2.times(row(J2, g.block + r));
          y(g.row + r) += sum[0] + sum[1];
        }
      } else if (g.body1 > 0 || g.body2 > 0) {
        const Rows& J = g.body1 > 0 ? J1 : J2;
        const Column<3> moving(x[at(std::max(g.body1, g.body2))].data());
        for (int r = 0; r < g.rows; ++r) {
          const Pair sum = moving.times(row(J, g.block + r));
          y(g.row + r) += sum[0] + sum[1];
        }
      }
    }
  }
  template <class X, class Y>
  void add_times(const std::vector<X>& x, Y& y) const {
    for (const RowGroup& g : data_->groups) {
      for (int r = 0; r < g.rows; ++r) {
        RowOf<X> sum = y.row(g.row + r);
        if (g.body1 > 0) add_row_times(J1, g.block + r, x[at(g.body1)], sum);
        if (g.body2 > 0) add_row_times(J2, g.block + r, x[at(g.body2)], sum);
        y.row(g.row + r) = sum;
      }
    }
  }
  // x -= J'lambda
  void subtract_transposed_times(const Eigen::VectorXd& lambda, std::vector<Vec<6>>& x) const {
    const auto subtract = [&](int body, const Rows& J, const RowGroup& g) {
      if (body == 0) return;
      double* to = x[at(body)].data();
      Column<3> sum(to);
      for (int r = 0; r < g.rows; ++r) sum.subtract(lambda(g.row + r), row(J, g.block + r));
      sum.store(to);
    };
    for (const RowGroup& g : data_->groups) subtract(g.body1, J1, g), subtract(g.body2, J2, g);
  }
  template <class X, class Y>
  void subtract_transposed_times(const Y& lambda, std::vector<X>& x) const {
    for (const RowGroup& g : data_->groups) {
      if (g.body1 > 0) subtract_group_times(J1, g, lambda, x[at(g.body1)]);
      if (g.body2 > 0) subtract_group_times(J2, g, lambda, x[at(g.body2)]);
    }
  }
  // M x for body i (1-based), and S += M.
  template <class X>
  X mass_times(int body, const X& x) const {
    const BodyData& b = data_->bodies[static_cast<std::size_t>(body)];
    X y;
    y.template topRows<3>() = b.mass * x.template topRows<3>();
    y.template bottomRows<3>().noalias() = b.J * x.template bottomRows<3>();
    return y;
  }
  void add_mass(BlockCholesky<6>& S) const;
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S);

  Eigen::MatrixXd dense() const;  // J, 6 columns per moving body

  BlockCholesky<6> matrix() const;  // a matrix with the pattern of J'J

  Rows J1, J2;  // one row per block row

 private:
  template <class X>
  using RowOf = Eigen::Matrix<double, 1, X::ColsAtCompileTime>;

  // Which of a row's three entries for displacements may not be zero; those for turning follow.
  struct Columns {
    int first = 0, last = 3;
  };
  const Columns& columns(int block) const { return columns_[static_cast<std::size_t>(block)]; }

  static const double* row(const Rows& J, int block) { return J.data() + 6 * block; }

  // Written out, on copies: the compiler unrolls these and keeps them in registers, and does neither with Eigen's
  // products with a row of a dynamic matrix.
  template <class X>
  void add_row_times(const Rows& J, int block, const X& x, RowOf<X>& sum) const {
    const double* row = J.row(block).data();
    for (int i = columns(block).first; i < columns(block).last; ++i) sum += row[i] * x.row(i);
    sum += row[3] * x.row(3) + row[4] * x.row(4) + row[5] * x.row(5);
  }
  template <class X, class Y>
  void subtract_group_times(const Rows& J, const RowGroup& g, const Y& lambda, X& x) const {
    X sum = x;
    for (int r = 0; r < g.rows; ++r) {
      const double* row = J.row(g.block + r).data();
      const RowOf<X> l = lambda.row(g.row + r);
      for (int i = columns(g.block + r).first; i < columns(g.block + r).last; ++i) sum.row(i) -= row[i] * l;
      for (int i = 3; i < 6; ++i) sum.row(i) -= row[i] * l;
    }
    x = sum;
  }
  void add_cross(double alpha, int block, Mat<6, 6>& S12) const;
  static std::size_t at(int body) { return static_cast<std::size_t>(body - 1); }
  void add_shared_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S);

  // A row with several constraints: its distinct moving bodies, and the off-diagonal blocks of their pairs.
  struct SharedRow {
    int row = 0;
    std::vector<int> bodies;
    std::vector<std::size_t> handles;  // of pairs (0,1), (0,2), (1,2), ...
    std::vector<Mat<1, 6>> J;          // per body
  };

  const MechanismData* data_;
  std::vector<Columns> columns_;     // per block row
  std::vector<std::size_t> handle_;  // per group: its off-diagonal block
  std::vector<SharedRow> shared_;
  std::vector<std::pair<int, int>> edges_;
};

}  // namespace mbsopt
