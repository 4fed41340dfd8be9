// One attempt at a step of a Runge-Kutta method: stages, error, dense stages, projection. RungeKuttaRun chooses the
// sizes.
//
//   StepAttempt attempt(mechanism, settings, method, tolerances);
//   attempt.start_at(t, y, angles);
//   if (attempt.begin() && attempt.solve(h, adaptive, exact, error) == StepOutcome::accepted) attempt.finish(t + h,
//   dense);
#pragma once

#include <memory>
#include <optional>

#include "core/dynamics/dynamics.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/projection/projection.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"
#include "core/step/implicit_stages.hpp"
#include "core/step/rosenbrock_stages.hpp"
#include "core/step/singular_passage.hpp"
#include "core/step/step.hpp"
#include "core/step/step_failure.hpp"

namespace mbsopt {

class StepAttempt {
 public:
  StepAttempt(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
              const ComponentTolerances& tolerances);

  void start_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void set_time(double t) { step_.t = t; }  // of the start
  // Evaluates the accelerations at the step's start, from which implicit stages begin. False where they do not exist.
  bool begin();
  // A first size from the start. Hairer, Norsett, Wanner I, section II.4, "Starting step size".
  double first_step(const IntegratorSettings& s, double span);

  // The stages of a step of size h. error: in tolerances, of an adaptive one. exact: implicit stages to rounding.
  StepOutcome solve(double h, bool adaptive, bool exact, double& error);
  StepOutcome finish(double t1, bool dense);  // dense stages, projection, branches of the angles

  // The change of velocity in tolerances if the accelerations at `at` and `beside` differ for a duration [s].
  double change_by(double at, double beside, double duration);

  // Returns whether a step of another size, of `wanted` as far as the singular position allows, is to be tried in its
  // place.
  bool better_placed_by(double wanted, double largest);
  void accept();           // the stages of the next step start from this one
  void advance(double t);  // the start moves to the step's end, whose time becomes t
  void restart();          // accelerations jump at the start: the last step is no start for the iterations of the next
  bool has_implicit_stages() const { return implicit_.has_value(); }
  void add_counts(SimulationStatistics& statistics) const;

  const Step& step() const { return step_; }
  Dynamics& dynamics() { return dynamics_; }
  Projector& projector() { return *projector_; }
  SingularPassage* passage() { return passage_ ? &*passage_ : nullptr; }  // of explicit methods through closed loops
  double projected_out() const { return projected_out_; }  // of the error of the last attempt, in tolerances

 private:
  bool evaluate_stage(int i);
  bool solve_stages(ImplicitStages::Goal goal);
  double error_of_step();
  double error_after_projection();
  void set_y_hat();

  Dynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  Step step_;
  std::optional<SingularPassage> passage_;
  double projected_out_ = 0;
  const MechanismData& data_;
  const Method& rk_;
  const ComponentTolerances& tolerances_;
  std::optional<ImplicitStages> implicit_;
  std::optional<RosenbrockStages> rosenbrock_;
  // If there is a passage.
  Eigen::VectorXd response_;
  ParameterBlock no_parameters_;
  LaneRows error_, projected_error_;
  Eigen::VectorXd work_, ydot_, y_stage_;
  bool first_stage_known_ = false;
  long evaluations_ = 0;
};

}  // namespace mbsopt
