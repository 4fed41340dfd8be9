#include "core/integrate/simulation.hpp"

#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <stdexcept>

#include "core/dynamics/assembly.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/integrate/cvodes.hpp"
#include "core/integrate/explicit_adjoint.hpp"
#include "core/integrate/explicit_run.hpp"
#include "core/integrate/explicit_tlm.hpp"

namespace mbsopt {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

const Method& method_of(const SimulationSettings& settings) {
  const Method* method = runge_kutta_method(settings.integrator.type);
  if (!method) throw std::invalid_argument("integrator '" + settings.integrator.type + "' is not known");
  if (!method->adaptive && !settings.integrator.step) {
    throw std::invalid_argument("integrator '" + settings.integrator.type + "' has no error estimate: give a step");
  }
  return *method;
}

// One forward integration from assembly to the end, with costs; what derivatives need hangs in by `follow`.
class Run {
 public:
  using Follow = std::function<bool(const Step&, std::span<const SampleEvent>)>;

  Run(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs)
      : start_(std::chrono::steady_clock::now()),
        mechanism_(mechanism),
        settings_(settings),
        costs_(costs),
        method_(method_of(settings)),
        assembly_(mechanism, settings.start_time) {
    if (mechanism.data().needs_motion) motion_.emplace(mechanism, settings.formulation);
    result_.psi.setZero(static_cast<Eigen::Index>(costs.size()));
    result_.last_good_time = settings.start_time;
    result_.y_initial = assembly_.result().y;
    if (!assembly_.result().ok) {
      result_.status = SimulationStatus::assembly_failed;
      result_.message = assembly_.result().message;
    }
  }

  const Method& method() const { return method_; }
  const Assembly& assembly() const { return assembly_; }
  SimulationResult& result() { return result_; }
  const Eigen::VectorXd& angles_end() const { return angles_end_; }

  void go(std::span<const double> observed, const std::function<void(std::size_t, const StatePoint&)>& observe,
          const RunOptions& options, const Follow& follow) {
    if (!result_.ok()) return;
    SampleSchedule schedule(costs_, observed, settings_.end_time);
    ExplicitRun run(mechanism_, settings_, method_);
    Eigen::VectorXd y(mechanism_.states());
    bool followed = true;
    auto accepted = [&](const Step& step) {
      const std::span<const SampleEvent> events = schedule.take(step.t1);
      add_running_costs(step, y);
      for (const SampleEvent& e : events) {
        if (!e.cost && !observe) continue;
        dense_output(method_, step, (e.time - step.t) / step.h, y);
        const StatePoint at{e.time, y, step.angles0, motion()};
        if (e.cost) {
          result_.psi(e.objective) += e.cost->value(at);
        } else {
          observe(e.index, at);
        }
      }
      if (follow && !follow(step, events)) followed = false;
    };
    run.run(
        assembly_.result().y, assembly_.result().angles, [&](double t1) { return schedule.due(t1); }, accepted, options,
        result_);
    angles_end_ = run.angles();
    if (result_.ok() && !followed) {
      result_.status = SimulationStatus::not_finite;
      result_.message =
          "the derivatives met a matrix that cannot be factored: a massless direction that no joint covers?";
    }
    if (!result_.ok()) return;
    for (std::size_t o = 0; o < costs_.size(); ++o) {
      if (costs_[o].terminal) {
        result_.psi(static_cast<Eigen::Index>(o)) +=
            costs_[o].terminal->value({settings_.end_time, result_.y_end, angles_end_, motion()});
      }
    }
    if (!result_.psi.allFinite()) {
      result_.status = SimulationStatus::not_finite;
      result_.message = "an objective is not finite (a logarithm, root or division outside its range?)";
    }
  }

  SimulationResult finish() {
    result_.statistics.wall_seconds = seconds_since(start_);
    return std::move(result_);
  }

 private:
  void add_running_costs(const Step& step, Eigen::VectorXd& y) {
    for (int i = 0; i < method_.stages; ++i) {
      if (method_.b[i] == 0) continue;
      bool copied = false;
      for (std::size_t o = 0; o < costs_.size(); ++o) {
        if (!costs_[o].running) continue;
        if (!copied) y = step.Y.col(i);
        copied = true;
        result_.psi(static_cast<Eigen::Index>(o)) +=
            step.h * method_.b[i] *
            costs_[o].running->value({step.t + method_.c[i] * step.h, y, step.angles0, motion()});
      }
    }
  }

  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }

  std::chrono::steady_clock::time_point start_;
  const Mechanism mechanism_;
  const SimulationSettings settings_;
  std::span<const Cost> costs_;
  const Method& method_;
  Assembly assembly_;
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  SimulationResult result_;
  Eigen::VectorXd angles_end_;
};

}  // namespace

SimulationResult simulate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                          const Sampling& sampling, const RunOptions& options) {
  if (is_cvodes(settings.integrator.type)) return cvodes_simulate(mechanism, settings, costs, sampling, options);
  Run run(mechanism, settings, costs);
  run.go(sampling.times, sampling.observe, options, {});
  return run.finish();
}

SimulationResult simulate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                              std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options) {
  if (is_cvodes(settings.integrator.type)) return cvodes_forward(mechanism, settings, costs, sampling, options);
  Run run(mechanism, settings, costs);
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  if (!result.ok()) return run.finish();
  TangentSweep sweep(mechanism, settings, run.method(), run.assembly().tangent());
  run.go(sampling.times, {}, options, [&](const Step& step, std::span<const SampleEvent> events) {
    return sweep.follow(step, costs, events, sampling, result.psi_rho);
  });
  if (result.ok()) sweep.finish(settings.end_time, result.y_end, run.angles_end(), costs, result.psi_rho);
  result.statistics.factorisations += sweep.factorisations();
  return run.finish();
}

SimulationResult simulate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                  std::span<const Cost> costs, const RunOptions& options) {
  if (is_cvodes(settings.integrator.type)) return cvodes_adjoint(mechanism, settings, costs, options);
  Run run(mechanism, settings, costs);
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  std::vector<StoredStep> kept;
  run.go({}, {}, options, [&](const Step& step, std::span<const SampleEvent> events) {
    kept.emplace_back(step, run.method(), events);
    result.statistics.adjoint_memory_bytes += kept.back().bytes();
    return true;
  });
  if (!result.ok()) return run.finish();
  AdjointSweep sweep(mechanism, settings, run.method(), costs);
  sweep.begin(settings.end_time, result.y_end, run.angles_end());
  while (!kept.empty()) {
    if (!sweep.step_back(kept.back())) {
      result.status = SimulationStatus::not_finite;
      result.message =
          fmt::format("the adjoint met a matrix that cannot be factored in the step at t = {:.6g} s", kept.back().t);
      return run.finish();
    }
    kept.pop_back();
  }
  Eigen::MatrixXd mu = sweep.mu();
  run.assembly().add_adjoint(sweep.lambda(), mu);
  result.psi_rho = mu.transpose();
  result.statistics.factorisations += sweep.factorisations();
  return run.finish();
}

}  // namespace mbsopt
