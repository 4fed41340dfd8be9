// Forward integration by a Runge-Kutta method: adaptive (PI control) or fixed steps, or a frozen sequence of steps.
// Observers see each accepted step: they sample it, accumulate objectives, keep it for a backward sweep, follow it with
// tangents, or doubt it.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/integrate/step_attempt.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"
#include "core/step/step.hpp"
#include "core/watch/pulse_watch.hpp"
#include "core/watch/run_guard.hpp"

namespace mbsopt {

// Looks at an accepted step. What it returns is an objection that ends the run there, or empty.
using StepObserver = std::function<std::string(const Step&)>;

class RungeKuttaRun {
 public:
  // Steps end at the kinks of sampled functions in laws and costs, and at the jumps of functions of time.
  RungeKuttaRun(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                std::span<const Cost> costs = {});

  // wants_dense(t1): whether a step that ends at t1 needs dense output. The observers see each accepted step in their
  // order. Fills status, statistics, steps, y_end.
  void run(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles,
           const std::function<bool(double t1)>& wants_dense, std::span<const StepObserver> observers,
           const RunOptions& options, SimulationResult& result);

  const Eigen::VectorXd& angles() const { return attempt_.step().angles0; }

 private:
  class Loop;

  const Mechanism mechanism_;
  SimulationSettings settings_;
  const Method& rk_;
  const ComponentTolerances tolerances_;
  StepAttempt attempt_;
  RunGuard guard_;
  PulseWatch pulses_;
  const std::vector<KinkedSignal> kinks_;
};

}  // namespace mbsopt
