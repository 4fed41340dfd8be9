// The equations of motion for a multistep method: ydot = f(t, y), independent of steps. The branch of each followed
// joint angle is a function of time: that of the last accepted step before it. So a backward integration finds the same
// f at the same (t, y).
#pragma once

#include <optional>
#include <vector>

#include "core/cvodes/cvodes_handles.hpp"
#include "core/dynamics/dynamics.hpp"
#include "core/dynamics/motion_solver.hpp"

namespace mbsopt::cvodes {

class Flow {
 public:
  using Numbers = Eigen::Map<Eigen::VectorXd>;

  Flow(const Mechanism& mechanism, const FormulationSettings& settings);

  void start(double t, const Eigen::VectorXd& angles);
  void accept(double t, const Eigen::VectorXd& y);  // a step ends here
  const Eigen::VectorXd& angles_at(double t) const;
  std::size_t history_bytes() const;

  // Solves the equations of motion at (t, y), unless it solved them there last. Returns false if that failed.
  bool evaluate(double t, const Numbers& y);
  const Eigen::VectorXd& ydot() const { return ydot_; }
  // Also prepares dynamics().acceleration_tangent() and add_adjoint() there.
  bool linearise(double t, const Numbers& y);

  // The state for costs and sensors. It is valid until the next call.
  StatePoint point(double t, const Numbers& y);
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }

  SpatialDynamics& dynamics() { return dynamics_.in_space(); }
  double worst_residual() const { return dynamics_.worst_residual(); }
  const MechanismData& data() const { return mechanism_.data(); }
  Eigen::Index states() const { return mechanism_.states(); }
  double last_time() const { return t_; }  // [s], where the equations were solved last
  long evaluations() const { return evaluations_; }
  Thrown& thrown() { return thrown_; }  // in any callback of a run on this flow

 private:
  const Mechanism mechanism_;
  Dynamics dynamics_;
  std::optional<MotionSolver> motion_;  // set if a sensor needs it
  std::vector<double> times_;           // of accepted steps, if angles are followed
  std::vector<Eigen::VectorXd> angles_;
  double t_;
  Eigen::VectorXd y_, ydot_, y_point_;
  bool solved_ = false, linearised_ = false;
  long evaluations_ = 0;
  Thrown thrown_;
};

}  // namespace mbsopt::cvodes
