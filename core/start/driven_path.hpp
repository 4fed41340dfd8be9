// The positions of a mechanism whose drives leave no freedom, continued in time on one branch.
//
//   positions    Phi(q, t) = 0,       from the predictor  q + h v + h^2/2 a,   a: (v1 - v0)/h of the last step
//   velocities   Phi_q v = -Phi_t,    from  v + h a
//
// A step is refused if its correction of the predictor is not small against h v, or if the trapezoidal rule disagrees.
// So the path never changes its branch. Haug, "Computer Aided Kinematics and Dynamics of Mechanical Systems" (1989),
// chapter 3.
//
//   DrivenPath path(mechanism, Model::spatial);
//   path.start(0, assembly.result().y, assembly.result().angles);
//   if (path.go_to(0.5)) use(path.state().y);
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/mechanism/mechanism.hpp"
#include "core/projection/projection.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

struct DrivenState {
  double t = 0;
  Eigen::VectorXd y, angles;  // (q, v); branch of each tracked joint angle
  Eigen::VectorXd a;          // vdot, estimated from the last step
};

class DrivenPath {
 public:
  DrivenPath(const Mechanism& mechanism, Model model);

  void start(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void start(const DrivenState& state) { state_ = state; }
  const DrivenState& state() const { return state_; }
  // Replaces the state by a more exact solution at the same time.
  void improve(const Eigen::VectorXd& y);

  // The longest step that the velocities allow.
  double step_limit() const;
  // Takes one step by h, to t1 = t + h. Returns false if it is refused; the path then keeps its state.
  bool advance(double h, double t1);
  // Takes as many steps as the branch needs. Returns false if they become shorter than `shortest`, or more than `most`.
  // The path then keeps the last accepted state.
  bool go_to(double t1, double shortest, long most);

  double position_violation(double* relative = nullptr) {
    return projector_->position_violation(state_.t, state_.angles, state_.y, relative);
  }
  double velocity_violation() { return projector_->velocity_violation(state_.t, state_.y); }
  // Serves derivatives at a state. The path keeps nothing in it between its steps.
  Projector& projector() { return *projector_; }
  long steps() const { return steps_; }
  long factorisations() const { return projector_->factorisations(); }

 private:
  bool keeps_branch(double h) const;

  const Mechanism mechanism_;
  std::unique_ptr<Projector> projector_;
  DrivenState state_;
  Eigen::VectorXd y_hat_, y_next_;
  long steps_ = 0;
};

}  // namespace mbsopt
