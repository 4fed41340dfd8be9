// One forward integration by a Runge-Kutta method, from the assembled state to the end, with the values of the costs.
// Derivatives follow its accepted steps.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/dynamics/motion_solver.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "core/run/sample_schedule.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

class QuadratureWatch;

class ForwardRun {
 public:
  // False where a factorisation failed.
  using Follow = std::function<bool(const Step&, std::span<const SampleEvent>)>;

  using Observe = std::function<void(std::size_t, const StatePoint&)>;

  // Throws std::invalid_argument where settings name no Runge-Kutta method, or one that lacks a step.
  ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
             Assembly assembly);

  // observed: times [s] at which `observe` sees the state. `follow` may be empty.
  void go(std::span<const double> observed, const Observe& observe, const RunOptions& options, const Follow& follow);

  const Method& method() const { return method_; }
  const Assembly& assembly() const { return assembly_; }
  SimulationResult& result() { return result_; }
  const Eigen::VectorXd& angles_end() const { return angles_end_; }
  SimulationResult finish() { return std::move(result_); }

 private:
  std::string add_running_costs(const Step& step, Eigen::VectorXd& y, QuadratureWatch* watch);
  void sample(const Step& step, std::span<const SampleEvent> events, const Observe& observe, Eigen::VectorXd& y);
  void add_terminal_costs();
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }

  const Mechanism mechanism_;
  const SimulationSettings settings_;
  std::span<const Cost> costs_;
  const Method& method_;
  Assembly assembly_;
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  SimulationResult result_;
  Eigen::VectorXd angles_end_;
  std::vector<double> g_;  // of the running costs at their nodes of a step
};

}  // namespace mbsopt
