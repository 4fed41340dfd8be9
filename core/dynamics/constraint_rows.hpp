// Phi_eta of all constraints as blocks of two 6-rows each, and the products the formulations need of it. A row of Phi
// that several constraints share (a gear) has several blocks.
#pragma once

#include <algorithm>
#include <vector>

#include "core/dynamics/block_cholesky.hpp"
#include "core/dynamics/pairs.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class ConstraintRows {
 public:
  static constexpr int kUnknowns = 6;  // per body
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  using Frames = std::vector<Frame>;

  explicit ConstraintRows(const MechanismData& data);

  Eigen::Index count() const { return data_->m; }
  void evaluate(const std::vector<Frame>& frames);  // J at the frames' positions

  // y -= J x; x: 6 numbers (or lanes of them) per moving body, body i at x[i - 1].
  void subtract_times(const std::vector<Vec<6>>& x, Eigen::VectorXd& y) const {
    for (const RowGroup& g : data_->groups) {
      if (g.body1 > 0 && g.body2 > 0) {
        const Column<3> x1(x[at(g.body1)].data()), x2(x[at(g.body2)].data());
        for (int r = 0; r < g.rows; ++r) {
          const Pair sum = x1.times(row(J1, g.block + r)) + x2.times(row(J2, g.block + r));
          y(g.row + r) -= sum[0] + sum[1];
        }
      } else if (g.body1 > 0 || g.body2 > 0) {
        const Rows& J = g.body1 > 0 ? J1 : J2;
        const Column<3> moving(x[at(std::max(g.body1, g.body2))].data());
        for (int r = 0; r < g.rows; ++r) {
          const Pair sum = moving.times(row(J, g.block + r));
          y(g.row + r) -= sum[0] + sum[1];
        }
      }
    }
  }
  void subtract_times(const std::vector<Lanes<6>>& x, LaneRows& y) const {
    for (const RowGroup& g : data_->groups) {
      LaneRow* to = entries(y) + g.row;
      for (const auto& [body, J] : {std::pair(g.body1, &J1), std::pair(g.body2, &J2)}) {
        if (body == 0) continue;
        const LaneRow* from = entries(x[at(body)]);
        const LaneRow x3 = from[3], x4 = from[4], x5 = from[5];
        const double* a = row(*J, g.block);
        const Columns* nonzero = &columns(g.block);
        for (int r = 0; r < g.rows; ++r, a += 6, ++nonzero) {
          LaneRow sum = to[r];
          if (nonzero->single()) {
            sum -= a[nonzero->first] * from[nonzero->first];
          } else if (nonzero->any()) {
            sum -= a[0] * from[0], sum -= a[1] * from[1], sum -= a[2] * from[2];
          }
          sum -= a[3] * x3, sum -= a[4] * x4, sum -= a[5] * x5;
          to[r] = sum;
        }
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
  void subtract_transposed_times(const LaneRows& lambda, std::vector<Lanes<6>>& x) const {
    for (const RowGroup& g : data_->groups) {
      const LaneRow* from = entries(lambda) + g.row;
      for (const auto& [body, J] : {std::pair(g.body1, &J1), std::pair(g.body2, &J2)}) {
        if (body == 0) continue;
        LaneRow* to = entries(x[at(body)]);
        LaneRow x3 = to[3], x4 = to[4], x5 = to[5];
        const double* a = row(*J, g.block);
        const Columns* nonzero = &columns(g.block);
        for (int r = 0; r < g.rows; ++r, a += 6, ++nonzero) {
          const LaneRow l = from[r];
          if (nonzero->single()) {
            to[nonzero->first] -= a[nonzero->first] * l;
          } else if (nonzero->any()) {
            to[0] -= a[0] * l, to[1] -= a[1] * l, to[2] -= a[2] * l;
          }
          x3 -= a[3] * l, x4 -= a[4] * l, x5 -= a[5] * l;
        }
        to[3] = x3, to[4] = x4, to[5] = x5;
      }
    }
  }
  // M x for body i (1-based), and S += M.
  template <class X>
  X mass_times(int body, const X& x) const {
    const BodyData& b = data_->bodies[static_cast<std::size_t>(body)];
    X out;
    const auto* from = entries(x);
    auto* to = entries(out);
    for (int i = 0; i < 3; ++i) to[i] = b.mass * from[i];
    for (int i = 0; i < 3; ++i) to[3 + i] = b.J(i, 0) * from[3] + b.J(i, 1) * from[4] + b.J(i, 2) * from[5];
    return out;
  }
  void add_mass(BlockCholesky<6>& S) const;
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S);

  Eigen::MatrixXd dense() const;  // J, 6 columns per moving body

  BlockCholesky<6> matrix() const;  // a matrix with the pattern of J'J

  Rows J1, J2;  // one row per block row

 private:
  // Which of a row's three entries for displacements may not be zero; those for turning follow.
  struct Columns {
    int first = 0, last = 3;
    bool single() const { return last - first == 1; }
    bool any() const { return last != first; }
  };
  const Columns& columns(int block) const { return columns_[static_cast<std::size_t>(block)]; }

  static const double* row(const Rows& J, int block) { return J.data() + 6 * block; }

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
