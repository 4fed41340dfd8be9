// What a budget of memory costs an adjoint run: 1e5 fixed steps of a pendulum within simulation.adjoint_memory_mib.
//   time_ratio   wall time within the budget / wall time with everything kept
//   recomputed   steps computed again / steps
//   kept_mib     the most that was kept
// And of N-four-bars over 10 s, within 4 MiB:
//   grown_mib    by how much the process was largest during the run, beyond its size before (Linux)
#include <benchmark/benchmark.h>

#include <malloc.h>

#include <fstream>
#include <string>

#include "bench/linkage.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/simulate/simulation.hpp"

using namespace mbsopt;

namespace {

struct StateNorm final : PointCost {
  double value(const StatePoint& at) const override { return at.y.squaredNorm(); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut) const override {
    y_bar += 2 * scale * at.y;
    return at.y.squaredNorm();
  }
};

Scene long_swing() {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  Parameter length;
  length.name = "length", length.value = 0.7;
  scene.parameters.push_back(length);
  Body bar;
  bar.name = "bar", bar.mass = 1.0, bar.inertia = {0.01, 0.2, 0.2, 0.0, 0.0, 0.0};
  bar.com = {Expression::parse("length"), 0.0, 0.0};
  scene.bodies.push_back(bar);
  Joint pin;
  pin.name = "pin", pin.type = "revolute", pin.body1 = "ground", pin.body2 = "bar";
  pin.point1 = pin.point2 = VectorField{0.0, 0.0, 0.0};
  pin.axis1 = pin.axis2 = VectorField{0.0, 0.0, 1.0};
  scene.joints.push_back(pin);
  scene.simulation.end_time = 100;
  scene.simulation.integrator.type = "dopri5";
  scene.simulation.integrator.step = 1e-3;
  return scene;
}

void adjoint_memory(benchmark::State& state, double mib) {
  Scene scene = long_swing();
  const Mechanism mechanism(scene, Eigen::VectorXd::Constant(1, 0.7));
  std::vector<Cost> costs(1);
  costs[0].running = costs[0].terminal = std::make_shared<StateNorm>();
  const auto run = [&](double budget) {
    scene.simulation.adjoint_memory_mib = budget;
    return simulate_adjoint(mechanism, scene.simulation, costs).statistics;
  };
  for (auto _ : state) {
    double free = 1e300, bound = 1e300;
    SimulationStatistics last;
    for (int k = 0; k < 3; ++k) {  // in turn, and the least of each: the machine's other work falls on both
      free = std::min(free, run(1e6).wall_seconds);
      last = run(mib);
      bound = std::min(bound, last.wall_seconds);
    }
    state.counters["time_ratio"] = bound / free;
    state.counters["recomputed"] = static_cast<double>(last.recomputed_steps) / static_cast<double>(last.steps);
    state.counters["kept_mib"] = static_cast<double>(last.adjoint_memory_bytes) / (1024.0 * 1024.0);
  }
}

// "VmRSS" or "VmHWM" of this process [MiB]; 0 where the system does not tell.
double process_mib(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::stod(line.substr(key.size() + 1)) / 1024;
  }
  return 0;
}

void memory_of_four_bars(benchmark::State& state) {
  const bench::Linkage linkage = bench::four_bars(static_cast<int>(state.range(0)));
  Scene scene = bench::scene_of(linkage);
  Parameter mass;
  mass.name = "mass", mass.value = 1;
  scene.parameters.push_back(mass);
  scene.bodies[0].mass = Expression::parse("mass");
  scene.simulation.end_time = 10;
  scene.simulation.adjoint_memory_mib = 4;
  const Mechanism mechanism(scene, Eigen::VectorXd::Constant(1, 1));
  std::vector<Cost> costs(1);
  costs[0].running = costs[0].terminal = std::make_shared<StateNorm>();
  for (auto _ : state) {
    simulate(mechanism, scene.simulation, costs);  // what a run takes without its adjoint is there before
    malloc_trim(0);                                // what is free goes back to the system
    std::ofstream("/proc/self/clear_refs") << 5;   // the largest size so far: that of now
    const double before = process_mib("VmRSS");
    const SimulationStatistics statistics = simulate_adjoint(mechanism, scene.simulation, costs).statistics;
    const double mib = 1024.0 * 1024.0;
    state.counters["bodies"] = linkage.size();
    state.counters["budget_mib"] = scene.simulation.adjoint_memory_mib;
    state.counters["kept_mib"] = static_cast<double>(statistics.adjoint_memory_bytes) / mib;
    state.counters["grown_mib"] = process_mib("VmHWM") - before;
    state.counters["recomputed"] =
        static_cast<double>(statistics.recomputed_steps) / static_cast<double>(statistics.steps);
  }
}
BENCHMARK(memory_of_four_bars)
    ->Name("adjoint_memory/four_bars")
    ->Arg(2)
    ->Arg(10)
    ->Arg(40)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace

#define MBSOPT_ADJOINT_MEMORY(name, mib) \
  BENCHMARK_CAPTURE(adjoint_memory, name, mib)->Iterations(1)->Unit(benchmark::kMillisecond)

MBSOPT_ADJOINT_MEMORY(of_16_MiB, 16);
MBSOPT_ADJOINT_MEMORY(of_4_MiB, 4);
MBSOPT_ADJOINT_MEMORY(of_1_MiB, 1);
