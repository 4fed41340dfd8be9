// The equations of an assembly in the unknowns of its two levels: q, then v at a fixed q.
#pragma once

#include <Eigen/Core>

#include "core/start/assembly_equations.hpp"
#include "core/start/nearest_point.hpp"

namespace mbsopt {

// The poses of all bodies in the scene, from which an assembly starts.
Eigen::VectorXd position_guess(const MechanismData& data);

// A length for r and 1 for p. The length is the root mean square of entries in p over those in r, in rows of J with
// both.
Eigen::VectorXd sizes_of_poses(const Eigen::MatrixXd& J);

// qdot of motions xi = (rdot, omega in body axes) per body, as columns.
Eigen::MatrixXd rates_of_poses(const Eigen::VectorXd& q, const Eigen::MatrixXd& xi);

// The unknown is q, or v at a given q.
class AssemblyProblem : public NearestPointEquations {
 public:
  explicit AssemblyProblem(AssemblyEquations& positions) : equations_(positions) {}
  AssemblyProblem(AssemblyEquations& velocities, const Eigen::VectorXd& q) : equations_(velocities), q_(&q) {}

  Eigen::VectorXd values(const Eigen::VectorXd& x) const override { return equations_.values(state(x)); }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& x) const override {
    return equations_.gradients_in_y(state(x)).middleCols(first(x), x.size());
  }
  Eigen::MatrixXd curvature(const Eigen::VectorXd& x, const Eigen::VectorXd& nu) const override {
    return equations_.second(state(x), nu).y.middleCols(first(x), x.size());
  }
  double step_fraction(const Eigen::VectorXd& step) const override;
  Eigen::VectorXd retracted(const Eigen::VectorXd& x) const override;
  Eigen::VectorXd sizes(const Eigen::MatrixXd& J) const override { return sizes_of_poses(J); }
  // |J| x, where the largest entry of r and of p (or of their rates) replaces each entry of theirs.
  Eigen::VectorXd magnitudes(const Eigen::VectorXd& x) const override;
  Eigen::VectorXd weights() const override { return equations_.weights(); }
  void accept(const Eigen::VectorXd& x) override {
    if (!q_) equations_.continue_branches(state(x));
  }

 private:
  Eigen::Index first(const Eigen::VectorXd& x) const { return q_ ? x.size() : 0; }  // of the unknowns, in y
  Eigen::VectorXd state(const Eigen::VectorXd& x) const;

  AssemblyEquations& equations_;
  const Eigen::VectorXd* q_ = nullptr;  // null if it is the unknown
};

}  // namespace mbsopt
