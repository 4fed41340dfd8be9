// J and M of a planar model: three unknowns per body, (rddot along t1 and t2, omegadot about n), and the rows of
// PlanarModel::rows.
#pragma once

#include <vector>

#include "core/dynamics/planar_constraints.hpp"
#include "core/linear/block_cholesky.hpp"
#include "core/linear/block_kernels.hpp"
#include "core/linear/pairs.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class PlanarRows {
 public:
  static constexpr int kUnknowns = 3;  // per body
  using Frames = PlanarConstraints::Frames;

  explicit PlanarRows(const MechanismData& data);  // data.planar is set

  Eigen::Index count() const { return static_cast<Eigen::Index>(model_->rows.size()); }
  void evaluate(const Frames& frames);  // J

  // y -= J x; x: body i at x[i - 1]
  void subtract_times(const std::vector<Vec<3>>& x, Eigen::VectorXd& y) const { subtract_times(x, y.data()); }
  void subtract_times(const std::vector<Vec<3>>& x, double* y) const {
    for (const Point& p : points_) {
      double first = y[p.row], second = y[p.row2];
      if (p.body2 > 0) {
        const Vec<3>& b = x[of_body(p.body2)];
        first -= b(0) - p.x2[1] * b(2), second -= b(1) + p.x2[0] * b(2);
      }
      if (p.body1 > 0) {
        const Vec<3>& b = x[of_body(p.body1)];
        first += b(0) - p.x1[1] * b(2), second += b(1) + p.x1[0] * b(2);
      }
      y[p.row] = first, y[p.row2] = second;
    }
    for (const Entry& e : entries_) {
      const Vec<3>& b = x[of_body(e.body)];
      y[e.row] -= e.J[0] * b(0) + e.J[1] * b(1) + e.J[2] * b(2);
    }
  }
  void subtract_times(const std::vector<Lanes<3>>& x, LaneRows& y) const {
    if (!x.empty()) block_kernels().subtract_times_in_plane(view(), x[0].data(), y.data());
  }
  // x -= J'lambda
  void subtract_transposed_times(const Eigen::VectorXd& lambda, std::vector<Vec<3>>& x) const {
    subtract_transposed([&](int row) { return lambda(row); }, x);
  }
  void subtract_transposed_times(const LaneRows& lambda, std::vector<Lanes<3>>& x) const {
    if (!x.empty()) block_kernels().subtract_transposed_times_in_plane(view(), lambda.data(), x[0].data());
  }

  // Steps of BlockSaddleSolver (block_kernels.hpp), of a single vector without sizes.
  void load(const SaddleIterate& at, bool first, std::vector<Vec<3>>& correction) const;
  void correct(const SaddleIterate& at, bool first, const std::vector<Vec<3>>& correction) const;
  void load(const SaddleIterate& at, bool first, std::vector<Lanes<3>>& correction) const {
    block_kernels().load_lanes_in_plane(view(), at, first, correction[0].data());
  }
  SaddleSizes correct(const SaddleIterate& at, bool first, const std::vector<Lanes<3>>& correction) const {
    return block_kernels().correct_lanes_in_plane(view(), at, first, correction[0].data());
  }
  // J and S = M + J' diag(alpha) J; phi_ddot: null, Phiddot is PlanarConstraints'.
  void assemble(const Frames& frames, const Eigen::VectorXd& alpha, BlockCholesky<3>& S, Eigen::VectorXd* phi_ddot);
  // M x for body i (1-based), and S = M.
  template <class X>
  X mass_times(int body, const X& x) const {
    const PlanarBody& b = model_->bodies[static_cast<std::size_t>(body)];
    X out;
    const auto* from = entries(x);
    auto* to = entries(out);
    to[0] = b.mass * from[0], to[1] = b.mass * from[1], to[2] = b.inertia * from[2];
    return out;
  }
  void set_mass(BlockCholesky<3>& S) const;
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<3>& S) const;

  BlockCholesky<3> matrix() const { return BlockCholesky<3>(static_cast<int>(model_->bodies.size()) - 1, edges_); }

 private:
  using Point = RowsInPlane::Point;
  using Entry = RowsInPlane::Entry;  // those of a row follow each other
  struct PointPlace {
    int constraint;
    std::size_t handle;  // of the block of its two bodies
  };
  // Where a constraint's J goes.
  struct Single {
    int constraint, entry1, entry2;  // -1: the ground
  };
  // Two entries of one row.
  struct Pair {
    int entry1, entry2;
    std::size_t handle;
  };
  template <class Lambda>  // row -> number
  void subtract_transposed(const Lambda& lambda, std::vector<Vec<3>>& x) const {
    for (const Point& p : points_) {
      const double first = lambda(p.row), second = lambda(p.row2);
      if (p.body2 > 0) {
        Vec<3>& b = x[of_body(p.body2)];
        b(0) -= first, b(1) -= second, b(2) -= p.x2[0] * second - p.x2[1] * first;
      }
      if (p.body1 > 0) {
        Vec<3>& b = x[of_body(p.body1)];
        b(0) += first, b(1) += second, b(2) += p.x1[0] * second - p.x1[1] * first;
      }
    }
    for (const Entry& e : entries_) {
      Vec<3>& b = x[of_body(e.body)];
      const double l = lambda(e.row);
      for (int k = 0; k < 3; ++k) b(k) -= e.J[k] * l;
    }
  }
  static std::size_t of_body(int body) { return static_cast<std::size_t>(body - 1); }
  RowsInPlane view() const {
    return {points_.data(), points_.size(), entries_.data(), entries_.size(), bodies_.data(), bodies_.size()};
  }

  const PlanarModel* model_;
  std::vector<Point> points_;
  std::vector<PointPlace> point_places_;  // per point
  std::vector<RowsInPlane::Body> bodies_;
  std::vector<Entry> entries_;
  std::vector<Single> singles_;
  std::vector<Pair> pairs_;
  std::vector<std::pair<int, int>> edges_;
};

}  // namespace mbsopt
