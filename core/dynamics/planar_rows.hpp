// J and M of a planar model: three unknowns per body, (rddot along t1 and t2, omegadot about n), and the rows of
// PlanarModel::rows.
#pragma once

#include <vector>

#include "core/dynamics/planar_constraints.hpp"
#include "core/dynamics/row_products.hpp"
#include "core/linear/block_cholesky.hpp"
#include "core/linear/kernel_table.hpp"
#include "core/linear/pairs.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class PlanarRows : public RowProducts<PlanarRows, RowsInPlane> {
 public:
  using Frames = PlanarConstraints::Frames;

  explicit PlanarRows(const MechanismData& data);  // data.planar is set

  Eigen::Index count() const { return static_cast<Eigen::Index>(model_->rows.size()); }
  void evaluate(const Frames& frames);  // J

  // Sets J and S = M + J' diag(alpha) J. phi_ddot is null: PlanarConstraints computes Phiddot.
  void assemble(const Frames& frames, const Eigen::VectorXd& alpha, BlockCholesky<3>& S, Eigen::VectorXd* phi_ddot);
  // M x for body i (1-based).
  template <class X>
  X mass_times(int body, const X& x) const {
    const PlanarBody& b = model_->bodies[static_cast<std::size_t>(body)];
    X out;
    const auto* from = entries(x);
    auto* to = entries(out);
    to[0] = b.mass * from[0];
    to[1] = b.mass * from[1];
    to[2] = b.inertia * from[2];
    return out;
  }
  void write_dense(Eigen::MatrixXd& J) const;  // 3 columns per moving body
  BlockCholesky<3> matrix() const { return BlockCholesky<3>(static_cast<int>(model_->bodies.size()) - 1, edges_); }

  RowsInPlane view() const {
    return {points_.data(), points_.size(), entries_.data(), entries_.size(), bodies_.data(), bodies_.size()};
  }

 private:
  using Point = RowsInPlane::Point;
  using Entry = RowsInPlane::Entry;  // entries of a row are adjacent
  struct PointPlace {
    int constraint;
    std::size_t handle;  // of the block of its two bodies
  };
  // The entries to which a constraint adds its J.
  struct Single {
    int constraint, entry1, entry2;  // -1: the ground
  };
  // Two entries of one row.
  struct Pair {
    int entry1, entry2;
    std::size_t handle;
  };
  void set_mass(BlockCholesky<3>& S) const;                                           // S = M
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<3>& S) const;  // S += J' diag(alpha) J

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
