#include "core/simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/cvodes/cvodes.hpp"
#include "core/driven/driven_simulation.hpp"
#include "core/integrate/adjoint_sweep.hpp"
#include "core/integrate/checkpoints.hpp"
#include "core/integrate/forward_run.hpp"
#include "core/integrate/gradient_quadrature.hpp"
#include "core/integrate/replayer.hpp"
#include "core/integrate/tangent_sweep.hpp"
#include "core/run/run_arguments.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt {
namespace {

// Calls run() and records its wall time.
template <class F>
SimulationResult timed(F&& run) {
  const auto start = std::chrono::steady_clock::now();
  SimulationResult result = run();
  result.statistics.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

void require_settled(const SimulationSettings& settings) {
  if (settings.accuracy)
    throw std::invalid_argument(
        "simulation.accuracy: stands for an integrator that is still to be chosen; choose_accuracy() of "
        "optim/tradeoff/accuracy.hpp does");
}

// A change of the state by rtol changes derivatives by rtol A^2 of themselves, A the magnification of changes: second
// derivatives grow as the square of the first ones. Rounding changes them by up to B^2 roundings, B the largest change
// of the state by a shift in time: within a fast passage derivatives are so large, and cancel after it. This error
// belongs to no integrand.
void note_magnification(double A, double B, const SimulationSettings& settings, SimulationStatistics& statistics) {
  const double error = std::max(A * A * settings.integrator.rtol, B * B * std::numeric_limits<double>::epsilon());
  if (error > statistics.gradient_quadrature.error) statistics.gradient_quadrature = {error, "", settings.end_time};
}

// |ydot|/|y| at the start of a step, times the span of the run.
double shift_in_time(const Step& step, const SimulationSettings& settings) {
  return step.K.col(0).cwiseAbs().maxCoeff() / step.y0.cwiseAbs().maxCoeff() *
         (settings.end_time - settings.start_time);
}

RunOptions with_exact_stages(RunOptions options) {
  options.exact_stages = true;
  return options;
}

SimulationResult integrate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                           const Sampling& sampling, const RunOptions& options, Assembly start) {
  ForwardRun run(mechanism, settings, costs, std::move(start));
  run.go(sampling.times, sampling.observe, options, {});
  return run.finish();
}

SimulationResult integrate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                               std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options,
                               Assembly start) {
  ForwardRun run(mechanism, settings, costs, std::move(start));
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  if (!result.ok()) return run.finish();
  GradientQuadrature watch(mechanism, run.method(), costs);
  TangentSweep sweep(mechanism, settings, run.method(), run.assembly().tangent(), options.frozen ? nullptr : &watch);
  double shift = 0;
  run.go(sampling.times, {}, with_exact_stages(options), [&](const Step& step, std::span<const SampleEvent> events) {
    shift = std::max(shift, shift_in_time(step, settings));
    return sweep.follow(step, costs, events, sampling, result.psi_rho);
  });
  watch.add_to(result.statistics);
  if (result.ok()) sweep.finish(settings.end_time, result.y_end, run.angles_end(), costs, result.psi_rho);
  note_magnification(sweep.magnification(), shift, settings, result.statistics);
  result.statistics.linearised_states += sweep.linearised_states();
  result.statistics.factorisations += sweep.factorisations();
  return run.finish();
}

SimulationResult integrate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                   std::span<const Cost> costs, const RunOptions& options, Assembly start) {
  ForwardRun run(mechanism, settings, costs, std::move(start));
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  Checkpoints checkpoints(run.method(), settings.adjoint_memory_mib);
  double shift = 0;
  run.go({}, {}, with_exact_stages(options), [&](const Step& step, std::span<const SampleEvent> events) {
    shift = std::max(shift, shift_in_time(step, settings));
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
  const auto go_on = [&] { return !(stopped = options.progress && !options.progress(settings.end_time)); };
  const bool swept =
      checkpoints.go_back([&](const Snapshot& from, long last, const auto& dense,
                              const auto& sink) { return replayer.replay(from, last, dense, sink, go_on); },
                          [&](const StoredStep& step) {
                            t_back = step.t;
                            return go_on() && sweep.step_back(step);
                          });
  watch.add_to(result.statistics);
  result.statistics.adjoint_memory_bytes = checkpoints.peak_bytes();
  result.statistics.recomputed_steps = checkpoints.recomputed_steps();
  result.statistics.factorisations += replayer.factorisations();
  if (stopped) {
    result.status = SimulationStatus::stopped;
    result.message = fmt::format("stopped in the backward run, at t = {:.6g} s", t_back);
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
  note_magnification(sweep.magnification(result.psi), shift, settings, result.statistics);
  result.statistics.linearised_states += sweep.linearised_states();
  result.statistics.factorisations += sweep.factorisations();
  return run.finish();
}

void require_observer(const auto& sampling) {
  if (!sampling.times.empty() && !sampling.observe)
    throw std::invalid_argument("sampling: times without anything that observes (observe is empty)");
}

// Calls the one of the three functions that computes such a run.
template <class Cvodes, class Driven, class Integrated>
SimulationResult run_by(const Mechanism& mechanism, const SimulationSettings& settings, Cvodes&& by_cvodes,
                        Driven&& driven, Integrated&& integrated) {
  if (is_cvodes(settings.integrator.type)) return by_cvodes();
  return timed([&] {
    Assembly start(mechanism, settings.start_time);
    return is_solved(mechanism, settings, start) ? driven(start) : integrated(std::move(start));
  });
}

}  // namespace

SimulationResult simulate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                          const Sampling& sampling, const RunOptions& options) {
  require_settled(settings);
  check_run_arguments(mechanism, settings, costs, sampling.times, options);
  require_observer(sampling);
  return run_by(
      mechanism, settings, [&] { return cvodes_simulate(mechanism, settings, costs, sampling, options); },
      [&](auto& start) { return driven_simulate(mechanism, settings, costs, sampling, options, start); },
      [&](auto start) { return integrate(mechanism, settings, costs, sampling, options, std::move(start)); });
}

SimulationResult simulate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                              std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options) {
  require_settled(settings);
  check_run_arguments(mechanism, settings, costs, sampling.times, options);
  require_observer(sampling);
  return run_by(
      mechanism, settings, [&] { return cvodes_forward(mechanism, settings, costs, sampling, options); },
      [&](auto& start) { return driven_tlm(mechanism, settings, costs, sampling, options, start); },
      [&](auto start) { return integrate_tlm(mechanism, settings, costs, sampling, options, std::move(start)); });
}

SimulationResult simulate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                  std::span<const Cost> costs, const RunOptions& options) {
  require_settled(settings);
  check_run_arguments(mechanism, settings, costs, {}, options);
  return run_by(
      mechanism, settings, [&] { return cvodes_adjoint(mechanism, settings, costs, options); },
      [&](auto& start) { return driven_adjoint(mechanism, settings, costs, options, start); },
      [&](auto start) { return integrate_adjoint(mechanism, settings, costs, options, std::move(start)); });
}

}  // namespace mbsopt
