#include "core/dynamics/acceleration_tangents.hpp"

#include <algorithm>

#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

namespace {

// The tangents of one block of directions at a time, as rows of lanes.
class LaneTangents {
 public:
  LaneTangents(SpatialDynamics& dynamics, Accelerations a) : dynamics_(dynamics), of_z_(a == Accelerations::z) {
    const StateLayout layout{dynamics.data().n};
    a_dir.setZero(of_z_ ? 6 * layout.n : layout.positions(), kLanes);
    ydot_dir_.setZero(layout.size(), kLanes);
  }

  void set(const ParameterBlock& block, const LaneRows& y_dir) {
    if (!of_z_) return dynamics_.acceleration_tangent(block, y_dir, a_dir);
    dynamics_.tangent(block, y_dir, ydot_dir_);
    Eigen::Index row = 0;
    for (const Lanes<6>& z : dynamics_.z_tangent()) a_dir.middleRows<6>(row) = z, row += 6;
  }
  LaneRows a_dir;

 private:
  SpatialDynamics& dynamics_;
  const bool of_z_;
  LaneRows ydot_dir_;
};

}  // namespace

Eigen::MatrixXd acceleration_tangents(SpatialDynamics& dynamics, const Eigen::MatrixXd& directions, Accelerations a) {
  const ParameterBlock none = block_without_parameters(dynamics.data());
  LaneTangents tangents(dynamics, a);
  Eigen::MatrixXd out(tangents.a_dir.rows(), directions.cols());
  LaneRows y_dir(directions.rows(), kLanes);
  for (Eigen::Index first = 0; first < directions.cols(); first += kLanes) {
    const Eigen::Index lanes = std::min<Eigen::Index>(kLanes, directions.cols() - first);
    y_dir.setZero();
    y_dir.leftCols(lanes) = directions.middleCols(first, lanes);
    tangents.set(none, y_dir);
    out.middleCols(first, lanes) = tangents.a_dir.leftCols(lanes);
  }
  return out;
}

Eigen::MatrixXd acceleration_of_parameters(SpatialDynamics& dynamics, Accelerations a) {
  const MechanismData& d = dynamics.data();
  LaneTangents tangents(dynamics, a);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(tangents.a_dir.rows(), d.rho.size());
  const LaneRows at_rest = LaneRows::Zero(StateLayout{d.n}.size(), kLanes);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    tangents.set(block, at_rest);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (block.parameter[lane] >= 0) out.col(block.parameter[lane]) = tangents.a_dir.col(lane);
    }
  }
  return out;
}

}  // namespace mbsopt
