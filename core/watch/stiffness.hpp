// Tells whether accuracy or stability limits the steps of an explicit method. Stability limits them in a stiff scene.
// The watch uses stages that the step has computed anyway.
//
//   |lambda| ~ |f(t, Y_b) - f(t, Y_a)| / |Y_b - Y_a|      Y_a, Y_b: two stages at the same time
//
// This is an eigenvalue of f_y, the fastest one if the motion is stiff: the two stages differ by its mode (power
// iteration). Stability limits a step if h |lambda| is near the end of the stability region on the real axis. The
// region is |R(-x)| <= 1, R of the method's own table. Far beyond it no step would have been accepted, so the quotient
// has another cause. Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), section IV.2, "automatic
// stiffness detection"; as in their DOPRI5 and DOP853.
//
// Pairs: dopri5 and verner6 have two stages at the end of the step. For dopri853 it is one stage there, compared with
// the first stage of the next step. Methods rk2 and bs3 have no useful pair, and implicit methods have no such limit.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/watch/step_observer.hpp"

namespace mbsopt {

// The largest x with |R(-x')| <= 1 for all x' in [0, x], for explicit methods.
double real_stability_boundary(const Method& rk);

class StiffnessWatch final : public StepObserver {
 public:
  // Limits of h |lambda| in limited steps, as parts of the boundary. Step-size control varies it about and below the
  // boundary.
  static constexpr double kNear = 0.6, kBeyond = 1.3;

  StiffnessWatch(const Method& rk, Eigen::Index states, SimulationStatistics& statistics);

  std::string look_at(const SeenStep& step) override;

 private:
  void compare(const Eigen::Ref<const Eigen::VectorXd>& Y_a, const Eigen::Ref<const Eigen::VectorXd>& K_a,
               const Eigen::Ref<const Eigen::VectorXd>& Y_b, const Eigen::Ref<const Eigen::VectorXd>& K_b, double h);

  enum class Pair { none, in_step, across_steps };
  Pair pair_ = Pair::none;
  int first_ = 0, second_ = 0;  // stages of the pair; across steps: second_ of one and 0 of the next
  double boundary_ = 0;
  Eigen::VectorXd Y_last_, K_last_;  // across steps
  double t_last_ = 0, h_last_ = 0;
  SimulationStatistics& statistics_;
};

// Returns whether stability limited most steps, and as many as stiff motion takes.
bool is_stability_limited(const SimulationStatistics& statistics);
// Returns whether stability limited enough steps to make their derivatives wrong: a stretch of them suffices, a tenth
// of a long run.
bool may_spoil_derivatives(const SimulationStatistics& statistics);

// "the step is limited by stability in 93 % of the steps ..." with a remedy; empty if there are too few such steps. Set
// differentiated if derivatives of these very steps are taken. They are exact, but may be wrong by orders as
// derivatives of the motion. A mode that has decayed to rounding grows by |R| > 1 until its error reaches the
// tolerance. Derivatives grow with it from any size, because no step-size control looks at them.
std::string stiffness_warning(const SimulationStatistics& statistics, const std::string& integrator,
                              bool differentiated);

}  // namespace mbsopt
