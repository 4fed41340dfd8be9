// Forward integration by a Runge-Kutta method: adaptive (PI control) or fixed steps, or a frozen sequence of steps.
// Observers see each accepted step: they sample it, accumulate objectives, keep it for a backward sweep, follow it with
// tangents, or object to it.
//
//   StepAttempt attempt(mechanism, settings, method);  // serves any number of runs
//   RungeKuttaRun(attempt, costs, options, result).go(y, angles, observers);
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/event/crossing_search.hpp"
#include "core/event/switches.hpp"
#include "core/integrate/step_attempt.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/step/event_times.hpp"
#include "core/step/kink_times.hpp"
#include "core/step/singular_passage.hpp"
#include "core/step/step_control.hpp"
#include "core/watch/pulse_watch.hpp"
#include "core/watch/run_guard.hpp"
#include "core/watch/step_observer.hpp"
#include "core/watch/stiffness.hpp"
#include "core/watch/weak_joints.hpp"

namespace mbsopt {

class RungeKuttaRun {
 public:
  // Steps end at the kinks of sampled functions in laws and costs, and at the jumps of functions of time.
  // `switches` are those of the attempt's mechanism and of the costs, whose events end steps, too; or null.
  RungeKuttaRun(StepAttempt& attempt, std::span<const Cost> costs, const RunOptions& options, SimulationResult& result,
                Switches* switches = nullptr, MotionSource* motion = nullptr);

  // Fills status, statistics, steps, y_end. The observers see each accepted step in their order. Of given steps, it
  // takes those from `first` on and before `last`.
  void go(const Eigen::VectorXd& y, const Eigen::VectorXd& angles, std::span<StepObserver* const> observers,
          std::size_t first = 0, std::size_t last = SIZE_MAX);

 private:
  bool begin(const Eigen::VectorXd& y, const Eigen::VectorXd& angles);  // false: the result says why it cannot
  void choose_first_size();
  bool choose_size();
  StepOutcome try_step();
  bool passes_over_pulse();
  void follow_given_events();
  bool passes_event();
  void cross(const SwitchEvent& event, double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void cross_driven(double t);
  bool is_better_placed_elsewhere();
  void reject(StepOutcome outcome);
  void note_step();
  void choose_next_size();
  void advance();
  void add_statistics();
  std::string tolerances_or(std::string message) const;
  double size_to(double event) const;
  double limited(double h) const;
  SeenStep seen() const;

  bool ends_with(double t1) const {
    return frozen_ ? frozen_index_ + 1 == frozen_->sizes.size() && frozen_->to_the_end
                   : t1 >= end_ - kink_control_.gap();
  }
  bool goes_on() const { return result_.ok() && (frozen_ ? frozen_index_ < last_ : step_.t < end_); }

  StepAttempt& attempt_;
  const Step& step_;  // of the attempt
  const Mechanism& mechanism_;
  const SimulationSettings& settings_;
  const IntegratorSettings& integrator_;
  const RunOptions& options_;
  SimulationResult& result_;
  const StepSequence* const frozen_;  // the steps to take, or null
  const bool adaptive_;
  const double end_, span_;
  StepController controller_;
  std::optional<SingularPassage> passage_;  // of explicit methods through closed loops
  std::optional<PulseWatch> pulses_;        // unless steps are given
  EventTimes events_;
  KinkControl kink_control_;
  Switches* const switches_;
  std::optional<CrossingSearch> crossings_;  // unless steps are given
  std::vector<SwitchEvent> given_events_;    // with given steps
  RunGuard guard_;
  PenaltyWatch penalty_;
  StiffnessWatch stiffness_;
  std::vector<StepObserver*> observers_;
  double h_ = 0, longest_ = 0;              // the step to try; the longest one so far
  double error_ = 0;                        // of the step tried last
  double asked_ = 0;                        // h before a kink made it shorter
  double wanted_ = 0, largest_ = INFINITY;  // sizes that the error and the limits allow, where the passage chooses h
  std::optional<double> split_;             // the size before an event made it shorter
  std::size_t frozen_index_ = 0, last_ = 0;
  bool is_part_ = false;  // of the given steps, which the result does not list again
  int placed_again_ = 0;
};

}  // namespace mbsopt
