// One forward integration by a Runge-Kutta method, from the assembled state to the end, with the values of the costs.
// Derivatives follow its accepted steps.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "core/dynamics/motion_solver.hpp"
#include "core/event/switches.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "core/run/sample_schedule.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"
#include "core/watch/quadrature_watch.hpp"
#include "core/watch/step_observer.hpp"

namespace mbsopt {

class ForwardRun : private StepObserver {
 public:
  // False where a factorisation failed.
  using Follow = std::function<bool(const Step&, std::span<const SampleEvent>)>;
  // At an event, with the switch still held on its side before it.
  using Cross = std::function<void(const SwitchEvent&, const StatePoint&)>;

  // Throws std::invalid_argument where settings name no Runge-Kutta method, or one that lacks a step.
  ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
             Assembly assembly);

  // `follow` and `cross` may be empty.
  void go(const Sampling& sampling, const RunOptions& options, const Follow& follow, const Cross& cross = {});

  // Those of the derivatives, too.
  Switches& switches() { return switches_; }
  const Method& method() const { return method_; }
  const Assembly& assembly() const { return assembly_; }
  SimulationResult& result() { return result_; }
  StatePoint end() { return {settings_.end_time, result_.y_end, angles_end_, motion()}; }
  // The largest |ydot|/|y| at the start of a followed step, times the span of the run.
  double shift_in_time() const { return shift_in_time_; }
  SimulationResult finish() { return std::move(result_); }

 private:
  // The values of costs and samples of a step.
  bool reads_inside(double t1) const override { return sampling_->look_inside || schedule_->due(t1); }
  std::string look_at(const SeenStep& step) override;
  void cross(const SwitchEvent&, const StatePoint&) override {
    if (motion_) motion_->forget();
  }
  void add_running_costs(const Step& step);
  StatePoint inside(const Step& step, double t);  // by dense output, until the next call
  void sample(const Step& step);
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }

  const Mechanism given_;
  const std::span<const Cost> given_costs_;
  Switches switches_;
  const Mechanism mechanism_;  // of the switches
  const SimulationSettings settings_;
  const std::span<const Cost> costs_;
  const Method& method_;
  Assembly assembly_;
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  SimulationResult result_;
  QuadratureWatch quadrature_;
  bool judges_ = true;  // given steps have been judged where they were found
  std::optional<SampleSchedule> schedule_;
  std::span<const SampleEvent> samples_;  // in the present step
  const Sampling* sampling_ = nullptr;    // of the run that goes on
  double shift_in_time_ = 0;
  Eigen::VectorXd y_, angles_end_;
};

}  // namespace mbsopt
