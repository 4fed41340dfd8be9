#include "core/start/poses.hpp"

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/mechanism/constraint_gradient.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd position_guess(const MechanismData& d) {
  const StateLayout layout{d.n};
  VectorXd q(layout.positions());
  for (std::size_t k = 1; k < d.bodies.size(); ++k) q.segment<7>(layout.q(k)) = d.bodies[k].q;
  return q;
}

MatrixXd rates_of_poses(const VectorXd& q, const MatrixXd& xi) {
  MatrixXd qdot(q.size(), xi.cols());
  for (Index k = 0; k < xi.cols(); ++k) {
    for (Index r = 0; r < q.size(); r += 7) {
      const Vec<6> of_body = xi.col(k).segment<6>(r / 7 * 6);
      qdot.col(k).segment<3>(r) = of_body.head<3>();
      qdot.col(k).segment<4>(r + 3) = 0.5 * G_transposed_times(Vector4d(q.segment<4>(r + 3)), of_body.tail<3>());
    }
  }
  return qdot;
}

UnitRows unit_rows(const MechanismData& data, const std::vector<Frame>& frames) {
  return UnitRows(jacobian_in_motions(data, frames));
}

MatrixXd JointSolver::solve(const MatrixXd& b) const { return factor_.solve(rows_.scale.asDiagonal() * b); }
VectorXd JointSolver::solve_transposed(const VectorXd& f) const {
  return rows_.scale.cwiseProduct(VectorXd(factor_.solve_transposed(f)));
}
VectorXd JointSolver::transposed_times(const VectorXd& x) const {
  return rows_.J.transpose() * x.cwiseQuotient(rows_.scale);
}

}  // namespace mbsopt
