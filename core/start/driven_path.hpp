// The positions of a mechanism whose drives leave no freedom, continued in time on one branch.
//
//   positions    Phi(q, t) = 0,       from the predictor  q + h v + h^2/2 a,   a: (v1 - v0)/h of the last step
//   velocities   Phi_q v = -Phi_t,    from  v + h a
//
// A step is refused if its correction of the predictor is not small against h v, or if the trapezoidal rule disagrees.
// So the path never changes its branch. It continues the motion smoothly past instants at which J loses rank for a
// moment (singular_window.hpp). They are found where the regularity of J has fallen, before states lose digits. Haug,
// "Computer Aided Kinematics and Dynamics of Mechanical Systems" (1989), chapter 3.
//
//   DrivenPath path(mechanism, Model::spatial);
//   path.start(0, 1, assembly.result().y, assembly.result().angles);
//   if (path.go_to(0.5)) use(path.state().y);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/projection/projection.hpp"
#include "core/scene/settings.hpp"
#include "core/start/singular_window.hpp"

namespace mbsopt {

// Names a bushing that reaches half a turn between two states, a step apart, in words; empty if none does.
std::string past_half_turn(const MechanismData& data, const Eigen::VectorXd& before, double t,
                           const Eigen::VectorXd& y);

class DrivenPath {
 public:
  DrivenPath(const Mechanism& mechanism, Model model);

  // A step is refused if `watch` objects to the motion between its ends, in words.
  using Watch = std::function<std::string(const DrivenState& from, const DrivenState& to)>;
  void set_watch(Watch watch) { watch_ = std::move(watch); }
  const std::string& objection() const { return objection_; }  // to the last step tried

  void start(double t, double end, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void start(const DrivenState& state) { state_ = state; }
  const DrivenState& state() const { return state_; }

  // The longest step that the velocities allow.
  double step_limit() const;
  // Takes one step by h, to t1 = t + h. Returns false if it is refused; the path then keeps its state.
  bool advance(double h, double t1);
  // Takes as many steps as the branch needs. Returns false if they become shorter than `shortest`, or more than `most`.
  // The path then keeps the last accepted state.
  bool go_to(double t1, double shortest, long most);

  // Returns whether rounding of the state grows so much that its multipliers lose more than 4 digits.
  bool is_uncertain() const { return state_.regularity < 1e-3 * most_regular_ && !window_at(state_.t); }
  // The singular window that contains a time passed, or null.
  const SingularWindow* window_at(double t) const;
  const std::vector<SingularWindow>& windows() const { return windows_; }

  // The violations of a state that is solved; 0 for one that is continued.
  double position_violation(double* relative = nullptr) {
    if (relative) *relative = 0;
    return window_at(state_.t) ? 0 : projector_->position_violation(state_.t, state_.angles, state_.y, relative);
  }
  double velocity_violation() { return window_at(state_.t) ? 0 : projector_->velocity_violation(state_.t, state_.y); }
  // Serves derivatives at a state. The path keeps nothing in it between its steps.
  Projector& projector() { return *projector_; }
  long steps() const { return steps_; }  // solved, also those of windows
  long factorisations() const { return projector_->factorisations(); }

 private:
  bool step(double h, double t1);
  double regularity();  // after settle()
  void look_for_window();
  double locate(double near, double spacing, const DrivenState& base);
  double fill(SingularWindow& w, const DrivenState& base);
  bool keeps_branch(double h) const;

  const Mechanism mechanism_;
  const bool planar_;
  std::unique_ptr<Projector> projector_;
  Watch watch_;
  std::string objection_;
  DrivenState state_, before_;           // before the last step
  double first_ = 0, last_ = 0;          // of the run [s]
  double most_regular_ = 0;              // so far
  std::vector<SingularWindow> windows_;  // ascending
  Eigen::VectorXd y_hat_, y_next_, response_;
  long steps_ = 0;
};

}  // namespace mbsopt
