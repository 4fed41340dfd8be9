// The equations of an assembly in the unknowns of its two levels: q, then v at a fixed q.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/constraint/unit_norm.hpp"
#include "core/start/assembly_equations.hpp"
#include "core/start/nearest_point.hpp"

namespace mbsopt {

// The poses of all bodies in the scene, from which an assembly starts.
Eigen::VectorXd position_guess(const MechanismData& data);

// A length for r and 1 for p. The length is the root mean square of entries in p over those in r, in rows of J with
// both.
Eigen::VectorXd sizes_of_poses(const Eigen::MatrixXd& J);

// |J| x, where the largest entry of r and of p (or of their rates) replaces each entry of theirs.
Eigen::VectorXd magnitudes_of_terms(Eigen::Index rows, const std::vector<SparseEntry>& J, Eigen::Index first,
                                    const Eigen::VectorXd& x);

// The unknown is q; v has no effect.
class PositionProblem : public NearestPointEquations {
 public:
  explicit PositionProblem(AssemblyEquations& equations) : equations_(equations) {}

  Eigen::VectorXd values(const Eigen::VectorXd& q) const override { return equations_.values(state(q)); }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) const override {
    return equations_.gradients_in_y(state(q)).leftCols(q.size());
  }
  Eigen::MatrixXd curvature(const Eigen::VectorXd& q, const Eigen::VectorXd& nu) const override {
    return equations_.second(state(q), nu).y.leftCols(q.size());
  }
  // No Euler parameter changes by more than 0.3 in one step (about 0.6 rad); r enters linearly.
  double step_fraction(const Eigen::VectorXd& step) const override {
    double change = 0;
    for (Eigen::Index i = 3; i < step.size(); i += 7)
      change = std::max(change, step.segment<4>(i).lpNorm<Eigen::Infinity>());
    return change > 0.3 ? 0.3 / change : 1.0;
  }
  Eigen::VectorXd retracted(const Eigen::VectorXd& x) const override {
    Eigen::VectorXd q = x;
    for (Eigen::Index i = 3; i < q.size(); i += 7) q.segment<4>(i) = UnitNorm::project(q.segment<4>(i));
    return q;
  }
  Eigen::VectorXd sizes(const Eigen::MatrixXd& J) const override { return sizes_of_poses(J); }
  Eigen::VectorXd magnitudes(const Eigen::VectorXd& q) const override {
    return magnitudes_of_terms(equations_.rows(), equations_.sparse_gradients(state(q)).y, 0, q);
  }
  Eigen::VectorXd weights() const override { return equations_.weights(); }
  void accept(const Eigen::VectorXd& q) override { equations_.continue_branches(state(q)); }

 private:
  static Eigen::VectorXd state(const Eigen::VectorXd& q) {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(2 * q.size());
    y.head(q.size()) = q;
    return y;
  }
  AssemblyEquations& equations_;
};

// The unknown is v at a fixed q.
class VelocityProblem : public NearestPointEquations {
 public:
  VelocityProblem(const AssemblyEquations& equations, const Eigen::VectorXd& q) : equations_(equations), q_(q) {}

  Eigen::VectorXd values(const Eigen::VectorXd& v) const override { return equations_.values(state(v)); }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& v) const override {
    return equations_.gradients_in_y(state(v)).rightCols(v.size());
  }
  Eigen::MatrixXd curvature(const Eigen::VectorXd& v, const Eigen::VectorXd& nu) const override {
    return equations_.second(state(v), nu).y.rightCols(v.size());
  }
  double step_fraction(const Eigen::VectorXd&) const override { return 1; }
  Eigen::VectorXd retracted(const Eigen::VectorXd& v) const override { return v; }
  Eigen::VectorXd sizes(const Eigen::MatrixXd& J) const override { return sizes_of_poses(J); }
  Eigen::VectorXd magnitudes(const Eigen::VectorXd& v) const override {
    return magnitudes_of_terms(equations_.rows(), equations_.sparse_gradients(state(v)).y, v.size(), v);
  }
  Eigen::VectorXd weights() const override { return equations_.weights(); }

 private:
  Eigen::VectorXd state(const Eigen::VectorXd& v) const {
    Eigen::VectorXd y(2 * v.size());
    y << q_, v;
    return y;
  }
  const AssemblyEquations& equations_;
  const Eigen::VectorXd& q_;
};

}  // namespace mbsopt
