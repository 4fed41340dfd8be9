// J and M of a planar model: three unknowns per body, (rddot along t1 and t2, omegadot about n). Rows of Phi keep their
// numbers; those that hold by themselves in the plane are empty.
#pragma once

#include <vector>

#include "core/dynamics/block_cholesky.hpp"
#include "core/dynamics/planar_constraints.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class PlanarRows {
 public:
  static constexpr int kUnknowns = 3;  // per body
  using Frames = PlanarConstraints::Frames;

  explicit PlanarRows(const MechanismData& data);  // data.planar is set

  void evaluate(const Frames& frames);  // J

  // y += J x; x: body i at x[i - 1]
  template <class X, class Y>
  void add_times(const std::vector<X>& x, Y& y) const {
    using R = Row<X>;
    for (const Point& p : points_) {
      R first = R::Zero(), second = R::Zero();
      if (p.body2 > 0) {
        const X& b = x[at(p.body2)];
        first = b.row(0) - p.x2.im * b.row(2), second = b.row(1) + p.x2.re * b.row(2);
      }
      if (p.body1 > 0) {
        const X& b = x[at(p.body1)];
        first -= b.row(0) - p.x1.im * b.row(2), second -= b.row(1) + p.x1.re * b.row(2);
      }
      y.row(p.row) += first, y.row(p.row2) += second;
    }
    for (const Entry& e : entries_) {
      const X& b = x[at(e.body)];
      y.row(e.row) += e.J[0] * b.row(0) + e.J[1] * b.row(1) + e.J[2] * b.row(2);
    }
  }
  // x -= J'lambda
  template <class X, class Y>
  void subtract_transposed_times(const Y& lambda, std::vector<X>& x) const {
    using R = Row<X>;
    for (const Point& p : points_) {
      const R first = lambda.row(p.row), second = lambda.row(p.row2);
      if (p.body2 > 0) {
        X& b = x[at(p.body2)];
        b.row(0) -= first, b.row(1) -= second, b.row(2) -= p.x2.re * second - p.x2.im * first;
      }
      if (p.body1 > 0) {
        X& b = x[at(p.body1)];
        b.row(0) += first, b.row(1) += second, b.row(2) += p.x1.re * second - p.x1.im * first;
      }
    }
    for (const Entry& e : entries_) {
      X& b = x[at(e.body)];
      const R l = lambda.row(e.row);
      for (int k = 0; k < 3; ++k) b.row(k) -= e.J[k] * l;
    }
  }

  // M x for body i (1-based), and S += M.
  template <class X>
  X mass_times(int body, const X& x) const {
    const PlanarBody& b = model_->bodies[static_cast<std::size_t>(body)];
    X y;
    y.row(0) = b.mass * x.row(0), y.row(1) = b.mass * x.row(1), y.row(2) = b.inertia * x.row(2);
    return y;
  }
  void add_mass(BlockCholesky<3>& S) const;
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<3>& S) const;

  BlockCholesky<3> matrix() const { return BlockCholesky<3>(static_cast<int>(model_->bodies.size()) - 1, edges_); }

 private:
  template <class X>
  using Row = Eigen::Matrix<double, 1, X::ColsAtCompileTime>;

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
