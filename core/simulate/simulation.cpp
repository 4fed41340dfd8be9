#include "core/simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/cvodes/cvodes.hpp"
#include "core/driven/driven_simulation.hpp"
#include "core/integrate/adjoint_sweep.hpp"
#include "core/integrate/checkpoints.hpp"
#include "core/integrate/forward_run.hpp"
#include "core/integrate/runge_kutta_run.hpp"
#include "core/integrate/tangent_sweep.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/run/run_arguments.hpp"
#include "core/run/run_ends.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt {
namespace {

// A change of the state by rtol changes derivatives by rtol A^2 of themselves, A the magnification of changes: second
// derivatives grow as the square of the first ones. Rounding changes them by up to B^2 roundings, B the largest change
// of the state by a shift in time: within a fast passage derivatives are so large, and cancel after it. This error
// belongs to no integrand.
void note_magnification(double A, double B, const SimulationSettings& settings, SimulationStatistics& statistics) {
  const double error = std::max(A * A * settings.integrator.rtol, B * B * std::numeric_limits<double>::epsilon());
  if (error > statistics.gradient_quadrature.error) statistics.gradient_quadrature = {error, "", settings.end_time};
}

// The first switch that changes where the step of an event ends.
std::size_t first_of(const std::vector<SwitchEvent>& events, const SwitchEvent& event) {
  return std::ranges::lower_bound(events, event.step, {}, &SwitchEvent::step)->of;
}

RunOptions with_exact_stages(RunOptions options) {
  options.exact_stages = true;
  return options;
}

SimulationResult integrate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                           const Sampling& sampling, const RunOptions& options, Assembly start) {
  ForwardRun run(mechanism, settings, costs, std::move(start));
  run.go(sampling, options, {});
  return run.finish();
}

SimulationResult integrate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                               std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options,
                               Assembly start) {
  ForwardRun run(mechanism, settings, costs, std::move(start));
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  if (!result.ok()) return run.finish();
  Switches& switches = run.switches();
  TangentSweep sweep(switches.mechanism(), settings, run.method(), switches.costs(), sampling, run.assembly().tangent(),
                     !options.frozen, result.psi_rho);
  run.go(
      {sampling.times, {}}, with_exact_stages(options),
      [&](const Step& step, std::span<const SampleEvent> events) { return sweep.follow(step, events); },
      [&](const SwitchEvent& event, const StatePoint& at) {
        sweep.cross(switches, event, first_of(result.steps.events, event), at);
      });
  if (result.ok()) sweep.finish(run.end());
  sweep.add_to(result.statistics);
  note_magnification(sweep.magnification(), run.shift_in_time(), settings, result.statistics);
  return run.finish();
}

SimulationResult integrate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                   std::span<const Cost> costs, const RunOptions& options, Assembly start) {
  ForwardRun run(mechanism, settings, costs, std::move(start));
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  Checkpoints checkpoints(run.method(), settings.adjoint_memory_mib);
  run.go({}, with_exact_stages(options), [&](const Step& step, std::span<const SampleEvent> events) {
    checkpoints.keep(step, events);
    return true;
  });
  if (!result.ok()) return run.finish();
  Switches& switches = run.switches();
  AdjointSweep sweep(switches.mechanism(), settings, run.method(), switches.costs(), !options.frozen, run.end());
  bool stopped = false;
  double t_back = settings.end_time;
  const auto go_on = [&](double) { return !(stopped = options.progress && !options.progress(settings.end_time)); };
  // Computes steps again, bit for bit: what the checkpoints did not keep.
  std::optional<StepAttempt> attempt;
  SimulationResult again;
  const auto replay = [&](const Snapshot& from, long last, StepObserver& sink) {
    if (!attempt) attempt.emplace(switches.mechanism(), settings, run.method());
    again = {};
    const RunOptions given{&result.steps, go_on};
    StepObserver* const observer = &sink;
    RungeKuttaRun(*attempt, {}, given, again, &switches)
        .go(from.y0, from.angles, {&observer, 1}, static_cast<std::size_t>(from.step), static_cast<std::size_t>(last));
    checkpoints.set_end(attempt->step().y0, attempt->step().angles0);
    return again.ok();
  };
  std::vector<int> sides = switches.sides();
  auto event = result.steps.events.rbegin();
  std::size_t index = result.steps.sizes.size();
  const bool swept = checkpoints.go_back(replay, [&](const StoredStep& step) {
    t_back = step.t;
    switches.hold_all(sides);  // a replay has its own
    for (--index; event != result.steps.events.rend() && event->step == index; ++event) {
      const Eigen::VectorXd y = step.y1(), angles = step.angles0();
      sweep.cross_back(switches, *event, first_of(result.steps.events, *event), {step.t1, y, angles});
      sides[event->of] = event->before;
    }
    return go_on(t_back) && sweep.step_back(step);
  });
  sweep.add_to(result.statistics);
  result.statistics.adjoint_memory_bytes = checkpoints.peak_bytes();
  result.statistics.recomputed_steps = checkpoints.recomputed_steps();
  result.statistics.factorisations += again.statistics.factorisations;  // of all replays: one attempt counts them
  if (!swept) {
    if (stopped)
      result.stop(SimulationStatus::stopped, fmt::format("stopped in the backward run, at t = {:.6g} s", t_back));
    else
      result.stop(SimulationStatus::not_finite,
                  fmt::format("the adjoint met a matrix that cannot be factored in the step at t = {:.6g} s", t_back));
    return run.finish();
  }
  add_start_gradient(run.assembly(), sweep.lambda(), sweep.mu(), result);
  note_magnification(sweep.magnification(result.psi), run.shift_in_time(), settings, result.statistics);
  return run.finish();
}

// Checks the arguments and calls the one of the three functions that computes such a run.
template <class Samples, class Cvodes, class Driven, class Integrated>
SimulationResult run_by(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                        const Samples& sampling, const RunOptions& options, Cvodes&& by_cvodes, Driven&& driven,
                        Integrated&& integrated) {
  if (settings.accuracy)
    throw std::invalid_argument(
        "simulation.accuracy: stands for an integrator that is still to be chosen; choose_accuracy() of "
        "optim/tradeoff/accuracy.hpp does");
  check_run_arguments(mechanism, settings, costs, sampling.times, options);
  if (!sampling.times.empty() && !sampling.observe)
    throw std::invalid_argument("sampling: times without anything that observes (observe is empty)");
  const auto begin = std::chrono::steady_clock::now();
  const bool has_limits = !mechanism.data().limits.empty();
  const auto refused = [&](const char* why) {
    SimulationResult result;
    result.psi.setZero(static_cast<Eigen::Index>(costs.size()));
    result.stop(SimulationStatus::not_credible,
                "limit '" + mechanism.data().limits.front().name + "' has no effect: " + why);
    return result;
  };
  const auto run = [&] {
    if (is_cvodes(settings.integrator.type) && has_limits)
      return refused("CVODES does not follow impacts; take a Runge-Kutta method");
    if (is_cvodes(settings.integrator.type)) return by_cvodes(mechanism, settings, costs, sampling, options);
    Assembly start(mechanism, settings.start_time);
    const bool solved = is_solved(mechanism, settings, start);
    if (solved && has_limits) return refused("drives leave nothing free that could rebound from it");
    if (solved) return driven(mechanism, settings, costs, sampling, options, start);
    return integrated(mechanism, settings, costs, sampling, options, std::move(start));
  };
  SimulationResult result = run();
  result.statistics.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace

SimulationResult simulate(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                          const Sampling& sampling, const RunOptions& options) {
  return run_by(mechanism, settings, costs, sampling, options, cvodes_simulate, driven_simulate, integrate);
}

SimulationResult simulate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                              std::span<const Cost> costs, const TangentSampling& sampling, const RunOptions& options) {
  const auto driven = [](const auto&... of) { return driven_tlm(of...); };
  return run_by(mechanism, settings, costs, sampling, options, cvodes_forward, driven, integrate_tlm);
}

SimulationResult simulate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                  std::span<const Cost> costs, const RunOptions& options) {
  return run_by(
      mechanism, settings, costs, Sampling(), options,
      [](auto& m, auto& s, auto c, auto&, auto& o) { return cvodes_adjoint(m, s, c, o); },
      [](auto& m, auto& s, auto c, auto&, auto& o, auto& start) { return driven_adjoint(m, s, c, o, start); },
      [](auto& m, auto& s, auto c, auto&, auto& o, Assembly start) {
        return integrate_adjoint(m, s, c, o, std::move(start));
      });
}

}  // namespace mbsopt
