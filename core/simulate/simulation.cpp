#include "core/simulate/simulation.hpp"

#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <stdexcept>

#include "core/cvodes/cvodes.hpp"
#include "core/driven/driven_simulation.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/integrate/adjoint_sweep.hpp"
#include "core/integrate/checkpoints.hpp"
#include "core/integrate/gradient_quadrature.hpp"
#include "core/integrate/runge_kutta_run.hpp"
#include "core/integrate/tangent_sweep.hpp"
#include "core/run/run_arguments.hpp"
#include "core/start/assembly.hpp"
#include "core/watch/jump_watch.hpp"
#include "core/watch/quadrature_watch.hpp"
#include "core/watch/zero_length.hpp"

namespace mbsopt {
namespace {

// run(), with the time that it took.
template <class F>
SimulationResult timed(F&& run) {
  const auto start = std::chrono::steady_clock::now();
  SimulationResult result = run();
  result.statistics.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

const Method& method_of(const SimulationSettings& settings) {
  const Method* method = runge_kutta_method(settings.integrator.type);
  if (!method) throw std::invalid_argument("integrator '" + settings.integrator.type + "' is not known");
  if (!method->adaptive && !settings.integrator.step) {
    throw std::invalid_argument("integrator '" + settings.integrator.type + "' has no error estimate: give a step");
  }
  return *method;
}

void require_settled(const SimulationSettings& settings) {
  if (settings.accuracy)
    throw std::invalid_argument(
        "simulation.accuracy: stands for an integrator that is still to be chosen; choose_accuracy() of "
        "optim/tradeoff/accuracy.hpp does");
}

RunOptions with_exact_stages(RunOptions options) {
  options.exact_stages = true;
  return options;
}

// One forward integration from assembly to the end, with costs; what derivatives need hangs in by `follow`.
class Run {
 public:
  using Follow = std::function<bool(const Step&, std::span<const SampleEvent>)>;

  Run(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs, Assembly assembly)
      : mechanism_(mechanism),
        settings_(settings),
        costs_(costs),
        method_(method_of(settings)),
        assembly_(std::move(assembly)) {
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
    RungeKuttaRun run(mechanism_, settings_, method_, costs_);
    Eigen::VectorXd y(mechanism_.states());
    bool followed = true;
    QuadratureWatch watch(method_, costs_, motion());
    std::optional<JumpWatch> jumps;
    if (follow && !options.frozen) {  // given steps have been looked at where they were found
      jumps.emplace(mechanism_, settings_, costs_, motion());
      jumps->begin({settings_.start_time, assembly_.result().y, assembly_.result().angles, motion()});
    }
    std::string objection;  // to running costs, to derivatives
    auto accepted = [&](const Step& step) {
      const std::span<const SampleEvent> events = schedule.take(step.t1);
      add_running_costs(step, y, options.frozen ? nullptr : &watch, objection);
      if (jumps) jumps->look_at({step.t1, step.y1, step.angles1, motion()});
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
      if (!follow) return;
      if (!follow(step, events)) followed = false;
      if (objection.empty()) {
        objection = through_zero_length(mechanism_.data(), step.t, step.y0, step.t1, step.y1);
      }
    };
    RunOptions until_objection = options;
    until_objection.progress = [&](double t) {
      return objection.empty() && (!options.progress || options.progress(t));
    };
    run.run(
        assembly_.result().y, assembly_.result().angles, [&](double t1) { return schedule.due(t1); }, accepted,
        until_objection, result_);
    watch.add_to(result_.statistics);
    if (jumps) jumps->add_to(result_.statistics);
    if (!objection.empty()) {
      result_.status = SimulationStatus::not_credible;
      result_.message = objection;
    }
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
      result_.message = not_finite_costs(costs_, result_.psi);
    }
  }

  SimulationResult finish() { return std::move(result_); }

 private:
  // Each stage's state is copied once for all costs. watch: none where steps are given.
  void add_running_costs(const Step& step, Eigen::VectorXd& y, QuadratureWatch* watch, std::string& objection) {
    const std::size_t stages = static_cast<std::size_t>(method_.stages);
    g_.assign(stages * costs_.size(), 0.0);
    for (int i = 0; i < method_.stages; ++i) {
      if (method_.b[i] == 0) continue;
      bool copied = false;
      for (std::size_t o = 0; o < costs_.size(); ++o) {
        if (!costs_[o].running) continue;
        if (!copied) y = step.Y.col(i);
        copied = true;
        const StatePoint at{step.t + method_.c[i] * step.h, y, step.angles0, motion()};
        const std::size_t k = o * stages + static_cast<std::size_t>(i);
        g_[k] = costs_[o].running->value(at);
        result_.psi(static_cast<Eigen::Index>(o)) += step.h * method_.b[i] * g_[k];
      }
    }
    for (std::size_t o = 0; watch && objection.empty() && o < costs_.size(); ++o)
      if (costs_[o].running) objection = watch->look_at(step, o, std::span(g_).subspan(o * stages, stages));
  }

  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }

  const Mechanism mechanism_;
  const SimulationSettings settings_;
  std::span<const Cost> costs_;
  const Method& method_;
  Assembly assembly_;
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  SimulationResult result_;
  Eigen::VectorXd angles_end_;
  std::vector<double> g_;  // of the running costs at the stages of a step
};

// Computes steps of a run again, bit for bit.
class Replayer {
 public:
  Replayer(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
           const StepSequence& steps)
      : mechanism_(mechanism), settings_(settings), method_(method), steps_(steps) {}

  bool replay(const Snapshot& from, long last, const std::function<bool()>& dense,
              const std::function<void(const Step&)>& sink) {
    if (!run_) run_.emplace(mechanism_, settings_, method_);
    Snapshot at = from;
    while (at.step < last) {
      const long next = std::min(last, at.step + kStretch);
      StepSequence part;
      part.times.assign(steps_.times.begin() + at.step, steps_.times.begin() + next);
      part.sizes.assign(steps_.sizes.begin() + at.step, steps_.sizes.begin() + next);
      part.to_the_end = static_cast<std::size_t>(next) == steps_.times.size();
      SimulationResult result;
      RunOptions options;
      options.frozen = &part;
      run_->run(
          at.y0, at.angles, [&](double) { return dense(); }, sink, options, result);
      factorisations_ = result.statistics.factorisations;  // of all calls so far
      if (!result.ok()) return false;
      at = {next, result.y_end, run_->angles()};
    }
    return true;
  }
  long factorisations() const { return factorisations_; }

 private:
  static constexpr long kStretch = 256;  // steps at once: their list is copied
  const Mechanism& mechanism_;
  const SimulationSettings& settings_;
  const Method& method_;
  const StepSequence& steps_;
  std::optional<RungeKuttaRun> run_;  // made where it is needed
  long factorisations_ = 0;
};

SimulationResult integrate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                           const Sampling& sampling, const RunOptions& options, Assembly start) {
  Run run(mechanism, settings, costs, std::move(start));
  run.go(sampling.times, sampling.observe, options, {});
  return run.finish();
}

SimulationResult integrate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                               std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options,
                               Assembly start) {
  Run run(mechanism, settings, costs, std::move(start));
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  if (!result.ok()) return run.finish();
  GradientQuadrature watch(mechanism, run.method(), costs);
  TangentSweep sweep(mechanism, settings, run.method(), run.assembly().tangent(), options.frozen ? nullptr : &watch);
  run.go(sampling.times, {}, with_exact_stages(options), [&](const Step& step, std::span<const SampleEvent> events) {
    return sweep.follow(step, costs, events, sampling, result.psi_rho);
  });
  watch.add_to(result.statistics);
  if (result.ok()) sweep.finish(settings.end_time, result.y_end, run.angles_end(), costs, result.psi_rho);
  result.statistics.linearised_states += sweep.linearised_states();
  result.statistics.factorisations += sweep.factorisations();
  return run.finish();
}

SimulationResult integrate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                   std::span<const Cost> costs, const RunOptions& options, Assembly start) {
  Run run(mechanism, settings, costs, std::move(start));
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  Checkpoints checkpoints(run.method(), settings.adjoint_memory_mib);
  run.go({}, {}, with_exact_stages(options), [&](const Step& step, std::span<const SampleEvent> events) {
    checkpoints.keep(step, events);
    return true;
  });
  if (!result.ok()) return run.finish();
  GradientQuadrature watch(mechanism, run.method(), costs);
  AdjointSweep sweep(mechanism, settings, run.method(), costs, options.frozen ? nullptr : &watch);
  sweep.begin(settings.end_time, result.y_end, run.angles_end());
  Replayer replayer(mechanism, settings, run.method(), result.steps);
  double t_back = settings.end_time;
  bool stopped = false;
  const bool swept = checkpoints.go_back([&](const Snapshot& from, long last, const auto& dense,
                                             const auto& sink) { return replayer.replay(from, last, dense, sink); },
                                         [&](const StoredStep& step) {
                                           t_back = step.t;
                                           stopped = options.progress && !options.progress(settings.end_time);
                                           return !stopped && sweep.step_back(step);
                                         });
  watch.add_to(result.statistics);
  result.statistics.adjoint_memory_bytes = checkpoints.peak_bytes();
  result.statistics.recomputed_steps = checkpoints.recomputed_steps();
  result.statistics.factorisations += replayer.factorisations();
  if (stopped) {
    result.status = SimulationStatus::stopped;
    result.message = fmt::format("stopped on the way back, at t = {:.6g} s", t_back);
    return run.finish();
  }
  if (!swept) {
    result.status = SimulationStatus::not_finite;
    result.message =
        fmt::format("the adjoint met a matrix that cannot be factored in the step at t = {:.6g} s", t_back);
    return run.finish();
  }
  Eigen::MatrixXd mu = sweep.mu();
  const Eigen::MatrixXd lambda = sweep.lambda();
  run.assembly().add_adjoint(lambda, mu);
  result.psi_y_initial = lambda.transpose();
  result.psi_rho = mu.transpose();
  result.statistics.linearised_states += sweep.linearised_states();
  result.statistics.factorisations += sweep.factorisations();
  return run.finish();
}

}  // namespace

SimulationResult simulate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                          const Sampling& sampling, const RunOptions& options) {
  require_settled(settings);
  check_run_arguments(mechanism, settings, costs, sampling.times, options);
  if (is_cvodes(settings.integrator.type)) return cvodes_simulate(mechanism, settings, costs, sampling, options);
  return timed([&] {
    Assembly start(mechanism, settings.start_time);
    return is_solved(mechanism, settings, start)
               ? driven_simulate(mechanism, settings, costs, sampling, options, start)
               : integrate(mechanism, settings, costs, sampling, options, std::move(start));
  });
}

SimulationResult simulate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                              std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options) {
  require_settled(settings);
  check_run_arguments(mechanism, settings, costs, sampling.times, options);
  if (!sampling.times.empty() && !sampling.observe)
    throw std::invalid_argument("sampling: times without anything that observes (observe is empty)");
  if (is_cvodes(settings.integrator.type)) return cvodes_forward(mechanism, settings, costs, sampling, options);
  return timed([&] {
    Assembly start(mechanism, settings.start_time);
    return is_solved(mechanism, settings, start)
               ? driven_tlm(mechanism, settings, costs, sampling, options, start)
               : integrate_tlm(mechanism, settings, costs, sampling, options, std::move(start));
  });
}

SimulationResult simulate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                  std::span<const Cost> costs, const RunOptions& options) {
  require_settled(settings);
  check_run_arguments(mechanism, settings, costs, {}, options);
  if (is_cvodes(settings.integrator.type)) return cvodes_adjoint(mechanism, settings, costs, options);
  return timed([&] {
    Assembly start(mechanism, settings.start_time);
    return is_solved(mechanism, settings, start)
               ? driven_adjoint(mechanism, settings, costs, options, start)
               : integrate_adjoint(mechanism, settings, costs, options, std::move(start));
  });
}

}  // namespace mbsopt
