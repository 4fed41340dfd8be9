// Poses q = (r, p) of all bodies, their motions xi = (rdot, omega in body axes), 6 numbers per body, and what joints
// and drives leave of these motions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/linear/dense.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/sensor/body_at.hpp"
#include "core/start/nearest_point_linearisation.hpp"

namespace mbsopt {

// The poses of all bodies in the scene, from which an assembly starts.
Eigen::VectorXd position_guess(const MechanismData& data);

// Vectors per body, one after another.
inline Eigen::Map<const Eigen::VectorXd> flat(const std::vector<Vec<6>>& x) {
  return {x.front().data(), 6 * static_cast<Eigen::Index>(x.size())};
}

// qdot of motions xi, as columns.
Eigen::MatrixXd rates_of_poses(const Eigen::VectorXd& q, const Eigen::MatrixXd& xi);

// Phi_xi at given frames: joints and drives leave the motions with Phi_xi xi = 0.
UnitRows unit_rows(const MechanismData& data, const std::vector<Frame>& frames);

// Linear solves with J = Phi_xi of any rank, without masses: the solutions of least size.
class JointSolver {
 public:
  JointSolver(const MechanismData& data, const std::vector<Frame>& frames, double threshold = UnitRows::kRankThreshold)
      : rows_(unit_rows(data, frames)), factor_(rows_.J, threshold) {}

  Eigen::Index rank() const { return factor_.rank(); }
  const Eigen::MatrixXd& unit_rows_of_J() const { return rows_.J; }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;             // J x = b
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& f) const;  // J'x = f
  Eigen::VectorXd transposed_times(const Eigen::VectorXd& x) const;  // J'x

 private:
  UnitRows rows_;
  OrthogonalDecomposition factor_;
};

}  // namespace mbsopt
