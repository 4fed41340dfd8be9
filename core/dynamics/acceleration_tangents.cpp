#include "core/dynamics/acceleration_tangents.hpp"

#include <algorithm>

#include "core/body/state_layout.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {
namespace {

// The tangents of qddot or z in one block of directions, as columns.
Eigen::MatrixXd tangents(SpatialDynamics& dynamics, const ParameterBlock& block, const LaneRows& y_dir,
                         Accelerations a) {
  LaneRows qddot_dir(StateLayout{dynamics.data().n}.positions(), kLanes);
  dynamics.acceleration_tangent(block, y_dir, qddot_dir);
  if (a == Accelerations::qddot || qddot_dir.size() == 0) return qddot_dir;
  const std::vector<Lanes<6>>& z_dir = dynamics.z_tangent();
  return Eigen::Map<const LaneRows>(z_dir[0].data(), 6 * static_cast<Eigen::Index>(z_dir.size()), kLanes);
}
Eigen::Index rows_of(const SpatialDynamics& dynamics, Accelerations a) {
  return (a == Accelerations::z ? 6 : 7) * static_cast<Eigen::Index>(dynamics.data().n);
}

}  // namespace

Eigen::MatrixXd acceleration_tangents(SpatialDynamics& dynamics, const Eigen::MatrixXd& directions, Accelerations a) {
  const ParameterBlock none = block_without_parameters(dynamics.data());
  Eigen::MatrixXd out(rows_of(dynamics, a), directions.cols());
  LaneRows y_dir(directions.rows(), kLanes);
  for (Eigen::Index first = 0; first < directions.cols(); first += kLanes) {
    const Eigen::Index lanes = std::min<Eigen::Index>(kLanes, directions.cols() - first);
    y_dir.setZero();
    y_dir.leftCols(lanes) = directions.middleCols(first, lanes);
    out.middleCols(first, lanes) = tangents(dynamics, none, y_dir, a).leftCols(lanes);
  }
  return out;
}

Eigen::MatrixXd acceleration_of_parameters(SpatialDynamics& dynamics, Accelerations a) {
  const MechanismData& d = dynamics.data();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(rows_of(dynamics, a), d.rho.size());
  const LaneRows at_rest = LaneRows::Zero(StateLayout{d.n}.size(), kLanes);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const Eigen::MatrixXd a_dir = tangents(dynamics, block, at_rest, a);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (block.parameter[lane] >= 0) out.col(block.parameter[lane]) = a_dir.col(lane);
    }
  }
  return out;
}

}  // namespace mbsopt
