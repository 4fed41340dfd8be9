// J and M of a planar model: three unknowns per body, (rddot along t1 and t2, omegadot about n), and the rows of
// PlanarModel::rows.
#pragma once

#include <vector>

#include "core/dynamics/block_cholesky.hpp"
#include "core/dynamics/pairs.hpp"
#include "core/dynamics/planar_constraints.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class PlanarRows {
 public:
  static constexpr int kUnknowns = 3;  // per body
  using Frames = PlanarConstraints::Frames;

  explicit PlanarRows(const MechanismData& data);  // data.planar is set

  Eigen::Index count() const { return static_cast<Eigen::Index>(model_->rows.size()); }
  void evaluate(const Frames& frames);  // J

  // y -= J x; x: body i at x[i - 1]
  template <class X, class Y>
  void subtract_times(const std::vector<X>& x, Y& y) const {
    auto* to = entries(y);
    for (const Point& p : points_) {
      auto first = to[p.row], second = to[p.row2];
      if (p.body2 > 0) {
        const auto* b = entries(x[at(p.body2)]);
        first -= b[0] - p.x2.im * b[2], second -= b[1] + p.x2.re * b[2];
      }
      if (p.body1 > 0) {
        const auto* b = entries(x[at(p.body1)]);
        first += b[0] - p.x1.im * b[2], second += b[1] + p.x1.re * b[2];
      }
      to[p.row] = first, to[p.row2] = second;
    }
    for (const Entry& e : entries_) {
      const auto* b = entries(x[at(e.body)]);
      to[e.row] -= e.J[0] * b[0] + e.J[1] * b[1] + e.J[2] * b[2];
    }
  }
  // x -= J'lambda
  template <class X, class Y>
  void subtract_transposed_times(const Y& lambda, std::vector<X>& x) const {
    const auto* l = entries(lambda);
    for (const Point& p : points_) {
      const auto first = l[p.row], second = l[p.row2];
      if (p.body2 > 0) {
        auto* b = entries(x[at(p.body2)]);
        b[0] -= first, b[1] -= second, b[2] -= p.x2.re * second - p.x2.im * first;
      }
      if (p.body1 > 0) {
        auto* b = entries(x[at(p.body1)]);
        b[0] += first, b[1] += second, b[2] += p.x1.re * second - p.x1.im * first;
      }
    }
    for (const Entry& e : entries_) {
      auto* b = entries(x[at(e.body)]);
      for (int k = 0; k < 3; ++k) b[k] -= e.J[k] * l[e.row];
    }
  }

  // M x for body i (1-based), and S += M.
  template <class X>
  X mass_times(int body, const X& x) const {
    const PlanarBody& b = model_->bodies[static_cast<std::size_t>(body)];
    X out;
    const auto* from = entries(x);
    auto* to = entries(out);
    to[0] = b.mass * from[0], to[1] = b.mass * from[1], to[2] = b.inertia * from[2];
    return out;
  }
  void add_mass(BlockCholesky<3>& S) const;
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<3>& S) const;

  BlockCholesky<3> matrix() const { return BlockCholesky<3>(static_cast<int>(model_->bodies.size()) - 1, edges_); }

 private:
  // A coincidence: [-I, -i x1] of body 1 and [I, i x2] of body 2, the ground's part left out.
  struct Point {
    int constraint, body1, body2, row, row2;
    std::size_t handle;  // of the block of its two bodies
    Plane x1, x2;
  };
  // A moving body in a single row. Those of a row follow each other.
  struct Entry {
    int body, row;
    double J[3];
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
  static std::size_t at(int body) { return static_cast<std::size_t>(body - 1); }

  const PlanarModel* model_;
  std::vector<Point> points_;
  std::vector<Entry> entries_;
  std::vector<Single> singles_;
  std::vector<Pair> pairs_;
  std::vector<std::pair<int, int>> edges_;
};

}  // namespace mbsopt
