#include "core/dynamics/acceleration_tangents.hpp"

#include <algorithm>

#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

Eigen::MatrixXd acceleration_tangents(SpatialDynamics& dynamics, const Eigen::MatrixXd& directions) {
  const ParameterBlock none = block_without_parameters(dynamics.data());
  Eigen::MatrixXd out(directions.rows() / 2, directions.cols());
  LaneRows y_dir(directions.rows(), kLanes), a_dir(out.rows(), kLanes);
  for (Eigen::Index first = 0; first < directions.cols(); first += kLanes) {
    const Eigen::Index lanes = std::min<Eigen::Index>(kLanes, directions.cols() - first);
    y_dir.setZero();
    y_dir.leftCols(lanes) = directions.middleCols(first, lanes);
    dynamics.acceleration_tangent(none, y_dir, a_dir);
    out.middleCols(first, lanes) = a_dir.leftCols(lanes);
  }
  return out;
}

Eigen::MatrixXd acceleration_of_parameters(SpatialDynamics& dynamics) {
  const MechanismData& d = dynamics.data();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(StateLayout{d.n}.positions(), d.rho.size());
  const LaneRows at_rest = LaneRows::Zero(2 * out.rows(), kLanes);
  LaneRows a_dir(out.rows(), kLanes);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    dynamics.acceleration_tangent(block, at_rest, a_dir);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (block.parameter[lane] >= 0) out.col(block.parameter[lane]) = a_dir.col(lane);
    }
  }
  return out;
}

}  // namespace mbsopt
