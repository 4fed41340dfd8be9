// A step of a Runge-Kutta method from a given start: stages, error, dense stages, projection. It is tried with as many
// sizes as it takes. RungeKuttaRun chooses the sizes.
//
//   StepAttempt attempt(mechanism, settings, method);
//   if (attempt.begin(t, y, angles) && attempt.solve(h, StepGoal::tolerance, false).outcome == StepOutcome::accepted &&
//       attempt.finish(t + h, dense) == StepOutcome::accepted) attempt.advance(t + h);
#pragma once

#include <memory>
#include <optional>

#include "core/dynamics/dynamics.hpp"
#include "core/event/impact.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/projection/projection.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"
#include "core/step/implicit_stages.hpp"
#include "core/step/rosenbrock_stages.hpp"
#include "core/step/step.hpp"
#include "core/step/step_failure.hpp"

namespace mbsopt {

// fixed: no error is estimated, and implicit stages are solved to rounding. tolerance: the error decides. derivatives:
// also, and the stages of a step that it allows are polished.
enum class StepGoal { fixed, tolerance, derivatives };

class StepAttempt {
 public:
  StepAttempt(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method);

  const Mechanism& mechanism() const { return mechanism_; }
  const SimulationSettings& settings() const { return settings_; }
  const Method& method() const { return rk_; }
  const ComponentTolerances& tolerances() const { return tolerances_; }
  bool is_planar() const { return dynamics_.is_planar(); }

  // Sets the start. False if the accelerations do not exist there.
  bool begin(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void set_time(double t) { step_.t = t; }  // of the start
  // A first size from the start, at most `span`. Hairer, Norsett, Wanner I, section II.4, "Starting step size".
  double first_size(double span);

  struct Solved {
    StepOutcome outcome;
    double error = 0;  // in tolerances
  };
  // The stages of a step of size h. near_singular: an error that is too large is estimated after projection.
  Solved solve(double h, StepGoal goal, bool near_singular);
  StepOutcome finish(double t1, bool dense);  // dense stages, projection, branches of the angles
  const Step& step() const { return step_; }
  // The change of velocity in tolerances if the accelerations at `at` and `beside` differ for a duration [s].
  double change_by(double at, double beside, double duration);
  void reject();           // the residual of this attempt does not count
  void advance(double t);  // accepts it: the start moves to its end, whose time becomes t
  // Moves the start from before an impact to after it. Returns the impulse, or nothing if joints leave no motion.
  std::optional<double> strike(Switches& switches, std::size_t limit);
  void restart();  // accelerations jump at the start, and nothing before it counts
  bool keeps_sizes() const { return implicit_.has_value(); }  // a new size costs a factor

  // Explicit methods through closed loops have responses at the end (Projector::response); others have none.
  Eigen::Index responses() const { return response_.size(); }
  const Eigen::VectorXd& response();
  double projected_error() const { return projected_error_; }  // that projection took out, in tolerances

  // These residuals are of the accelerations, in accepted and in rejected steps (Dynamics).
  double worst_residual() const { return dynamics_.worst_residual(); }
  double worst_of_rejected() const { return worst_of_rejected_; }
  Projector& projector() { return *projector_; }
  void add_to(SimulationStatistics& statistics) const;  // the work of all attempts

 private:
  bool evaluate_stage(int i);
  bool solve_stages(ImplicitStages::Goal goal);
  template <class Norm>
  double error_by(Norm&& norm);
  double norm_of_work() const;
  double error_of_step();
  double error_after_projection();
  void set_y_hat();

  const Mechanism mechanism_;
  const SimulationSettings settings_;
  const Method& rk_;
  const ComponentTolerances tolerances_;
  Dynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  Step step_;
  std::optional<ImplicitStages> implicit_;
  std::optional<RosenbrockStages> rosenbrock_;
  // If there are responses.
  Eigen::VectorXd response_;
  ParameterBlock no_parameters_;
  LaneRows error_lanes_, projected_lanes_;
  Eigen::VectorXd work_, ydot_, y_stage_;
  double projected_error_ = 0, accepted_residual_ = 0, worst_of_rejected_ = 0;
  bool first_stage_known_ = false;
  long evaluations_ = 0;
};

}  // namespace mbsopt
