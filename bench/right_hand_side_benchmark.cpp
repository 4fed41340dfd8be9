// What a right-hand side costs per body, as the mechanism grows.
//   us                one evaluation of the equations of motion, median [microseconds]
//   us_per_body       the same per body
//   run_us_per_body   per right-hand side and body of a run with the default method at steps of 1 ms: stages, error
//   norms
//                     and projections included
//   start_ms          compiling the scene and assembly, before a run
//   ratio             of the time per body at 10 000 bodies to that at 100, measured in turn
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>

#include "app/json/read_problem.hpp"
#include "bench/repeated.hpp"
#include "bench/right_hand_side.hpp"
#include "core/integrate/runge_kutta_run.hpp"
#include "core/start/assembly.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

struct Kind {
  const char* name;
  Linkage (*make)(int size);
  std::vector<int> sizes;
};
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {"planar_chain", planar_chain, {10, 50, 200, 1000, 10000}},
      {"spatial_chain", spatial_chain, {10, 50, 200, 1000, 10000}},
      {"tree", tree, {10, 50, 200, 1000, 10000}},
      {"four_bars", four_bars, {1, 10, 40, 333, 1000}},
      {"bricard", [](int) { return bricard(); }, {1}},
  };
  return all;
}

// Of a right-hand side within a run, without its start.
double seconds_of_run(const Linkage& linkage, const std::string& model) {
  Scene scene = scene_of(linkage);
  choose_model(scene.simulation, model);
  const int steps = std::clamp(20000 / linkage.size(), 10, 400);
  scene.simulation.integrator.step = 1e-3, scene.simulation.end_time = steps * 1e-3;
  const Mechanism mechanism(scene, Eigen::VectorXd(0));
  const Eigen::VectorXd y = start_of(linkage), angles;
  StepAttempt attempt(mechanism, scene.simulation, *runge_kutta_method(scene.simulation.integrator.type));
  const RunOptions options;
  std::vector<double> seconds;
  for (int i = 0; i < 7; ++i) {
    SimulationResult result;
    RungeKuttaRun run(attempt, {}, options, result);
    const ThreadClock clock;
    run.go(y, angles, {});
    seconds.push_back(clock.seconds() / static_cast<double>(result.statistics.rhs_evaluations));
  }
  return median(std::move(seconds));
}

void right_hand_side(benchmark::State& state, const Linkage& linkage, const std::string& model) {
  RightHandSide f = RightHandSide::of(linkage, model);
  const double bodies = linkage.size();
  for (auto _ : state) {
    if (!f()) return state.SkipWithError("no solution");
    const double us = 1e6 * median_seconds(f);
    state.counters["bodies"] = bodies;
    state.counters["us"] = us;
    state.counters["us_per_body"] = us / bodies;
    state.counters["run_us_per_body"] = 1e6 * seconds_of_run(linkage, model) / bodies;
  }
}

void of_problem(benchmark::State& state, const char* file) {
  const Problem problem = read_problem(std::string(MBSOPT_SOURCE_DIR "/problems/") + file);
  Eigen::VectorXd rho(static_cast<Eigen::Index>(problem.scene.parameters.size()));
  for (Eigen::Index k = 0; k < rho.size(); ++k) rho(k) = problem.scene.parameters[static_cast<std::size_t>(k)].value;
  const Mechanism mechanism(problem.scene, rho);
  const Assembly assembly(mechanism, problem.scene.simulation.start_time);
  const SimulationSettings& settings = problem.scene.simulation;
  Dynamics dynamics(mechanism, settings.formulation,
                    model_of(mechanism, settings, *runge_kutta_method(settings.integrator.type)));
  Eigen::VectorXd ydot(mechanism.states());
  for (auto _ : state) {
    const auto& start = assembly.result();
    const double us =
        1e6 * median_seconds([&] {
          benchmark::DoNotOptimize(dynamics.evaluate(problem.scene.simulation.start_time, start.y, start.angles, ydot));
        });
    state.counters["bodies"] = mechanism.bodies();
    state.counters["us"] = us;
    state.counters["us_per_body"] = us / mechanism.bodies();
  }
}

void start(benchmark::State& state, const Linkage& linkage) {
  const Scene scene = scene_of(linkage);
  for (auto _ : state) {
    state.counters["bodies"] = linkage.size();
    const auto assemble = [&] { Assembly(Mechanism(scene, Eigen::VectorXd(0)), 0); };
    state.counters["start_ms"] = 1e3 * median_seconds(assemble, 3);
  }
}

// Of the smaller mechanism as many copies' worth as make the two rounds alike long.
void growth(benchmark::State& state, const Linkage& small, const Linkage& large, const std::string& model) {
  RightHandSide f = RightHandSide::of(small, model), F = RightHandSide::of(large, model);
  const long times = large.size() / small.size();
  for (auto _ : state) {
    std::vector<double> ratios;
    for (int i = 0; i < 25; ++i) {
      const double few = seconds_of(f, times) / small.size(), many = seconds_of(F, 1) / large.size();
      if (i > 2) ratios.push_back(many / few);
    }
    state.counters["ratio"] = median(std::move(ratios));
  }
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto&& run) {
    benchmark::RegisterBenchmark(name.c_str(), run)->Iterations(1)->Unit(benchmark::kMillisecond);
  };
  for (const Kind& kind : kinds()) {
    for (const int size : kind.sizes) {
      const Linkage linkage = kind.make(size);
      for (const std::string& model : models_of(linkage)) {
        add(fmt::format("right_hand_side/{}/{}/{}", kind.name, size, model),
            [=](benchmark::State& state) { right_hand_side(state, linkage, model); });
      }
    }
  }
  for (const char* file : {"five_bar/design.json", "double_wishbone/quarter_car.json"}) {
    add(fmt::format("right_hand_side_of_problem/{}", file), [=](benchmark::State& state) { of_problem(state, file); });
  }
  for (const int windows : {10, 40, 100}) {
    add(fmt::format("start/four_bars/{}", windows), [=](benchmark::State& state) { start(state, four_bars(windows)); });
  }
  const auto add_growth = [&](const char* name, const Linkage& small, const Linkage& large) {
    for (const std::string& model : models_of(large)) {
      add(fmt::format("right_hand_side_growth/{}/{}", name, model),
          [=](benchmark::State& state) { growth(state, small, large, model); });
    }
  };
  add_growth("planar_chain", planar_chain(100), planar_chain(10000));
  add_growth("spatial_chain", spatial_chain(100), spatial_chain(10000));
  add_growth("tree", tree(100), tree(10000));
  add_growth("four_bars", four_bars(50), four_bars(5000));
  return true;
}();

}  // namespace
