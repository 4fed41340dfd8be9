// Forward integration by a Runge-Kutta method: adaptive (PI control) or fixed steps, or a frozen sequence of steps.
// Each accepted step goes to a sink, which observes, accumulates objectives, keeps it for a backward sweep, or follows
// it with tangents.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/integrate/step_attempt.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"
#include "core/step/step.hpp"
#include "core/step/step_failure.hpp"
#include "core/watch/penalty_watch.hpp"
#include "core/watch/pulse_watch.hpp"
#include "core/watch/run_guard.hpp"

namespace mbsopt {

class Mechanism;

class RungeKuttaRun {
 public:
  // Steps end at the kinks of sampled functions in laws and costs, and at the jumps of functions of time.
  RungeKuttaRun(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                std::span<const Cost> costs = {});

  using Sink = std::function<void(const Step&)>;
  // wants_dense(t1): whether a step that ends at t1 needs dense output. Fills status, statistics, steps, y_end.
  void run(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles,
           const std::function<bool(double t1)>& wants_dense, const Sink& accepted, const RunOptions& options,
           SimulationResult& result);

  const Eigen::VectorXd& angles() const { return attempt_.step.angles0; }

 private:
  using Outcome = StepOutcome;
  struct Course;

  // False, and course.result says why, where the run cannot begin or go on.
  bool begin(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles, Course& course);
  bool choose_size(Course& course);
  bool credible(Course& course);

  void choose_first_size(Course& course);
  Outcome try_step(const std::function<bool(double)>& wants_dense, Course& course);
  bool passes_over_pulse(Course& course);
  bool misplaced(Course& course);
  void reject(Outcome outcome, Course& course);
  void choose_next_size(Course& course);
  void advance(Course& course);
  void restart(Course& course);
  void add_statistics(Course& course);
  std::string tolerances_or(std::string message, const Course& course) const;

  double propose_step(double t, double h, double end, bool adaptive) const;
  double fastest_tracked_rate(const Eigen::VectorXd& y) const;
  Energy update_statistics(SimulationResult& result);

  const Mechanism mechanism_;
  SimulationSettings settings_;
  const Method& rk_;
  const ComponentTolerances tolerances_;
  StepAttempt attempt_;
  RunGuard guard_;
  PenaltyWatch penalty_;
  PulseWatch pulses_;
  const std::vector<KinkedSignal> kinks_;
};

}  // namespace mbsopt
