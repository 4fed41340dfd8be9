// Cost of gradients against one simulation: psi = integral of z^2 of the last point, over 20 and more parameters.
// Simulation, TLM and adjoint are timed in turn in one run, so that their ratios hold on a noisy machine:
//   adjoint_ratio = adjoint / simulation          tlm_per_parameter = (TLM / simulation - 1) / parameters
#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "bench/scenes.hpp"
#include "core/integrate/simulation.hpp"

using namespace mbsopt;

namespace {

struct Square final : PointCost {
  const Mechanism& mechanism;
  explicit Square(const Mechanism& m) : mechanism(m) {}
  double value(const StatePoint& at) const override {
    const double x = mechanism.sensor_value(0, at);
    return x * x;
  }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    const double x = mechanism.sensor_value(0, at);
    mechanism.add_sensor_gradient(0, at, 2 * scale * x, y_bar, rho_bar);
    return x * x;
  }
};

double median(std::vector<double> x) {
  std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2), x.end());
  return x[x.size() / 2];
}

void gradient_cost(benchmark::State& state, Scene scene, const char* method) {
  scene.simulation.integrator.type = method;
  const Mechanism mechanism(scene, bench::nominal(scene));
  Cost cost;
  cost.running = std::make_shared<Square>(mechanism);
  const std::vector<Cost> costs{cost};
  std::vector<double> adjoint_ratio, tlm_ratio, per_rhs;
  long steps = 0;
  for (auto _ : state) {
    const SimulationResult run = simulate(mechanism, scene.simulation, costs);
    const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, costs);
    const SimulationResult tlm = simulate_tlm(mechanism, scene.simulation, costs);
    if (!run.ok() || !adjoint.ok() || !tlm.ok()) {
      state.SkipWithError("a simulation failed");
      return;
    }
    const double seconds = run.statistics.wall_seconds;
    adjoint_ratio.push_back(adjoint.statistics.wall_seconds / seconds);
    tlm_ratio.push_back(tlm.statistics.wall_seconds / seconds);
    per_rhs.push_back(1e6 * seconds / static_cast<double>(run.statistics.rhs_evaluations) / mechanism.bodies());
    steps = run.statistics.steps;
  }
  state.counters["bodies"] = mechanism.bodies();
  state.counters["parameters"] = mechanism.parameters();
  state.counters["steps"] = static_cast<double>(steps);
  state.counters["rhs_us_per_body"] = median(per_rhs);
  state.counters["adjoint_ratio"] = median(adjoint_ratio);
  state.counters["tlm_per_parameter"] = (median(tlm_ratio) - 1) / mechanism.parameters();
}

}  // namespace

BENCHMARK_CAPTURE(gradient_cost, five_bar_dopri5, bench::five_bar(), "dopri5")
    ->Iterations(9)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_cost, five_bar_dopri853, bench::five_bar(), "dopri853")
    ->Iterations(9)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_cost, chain_20_dopri5, bench::chain(20, 24), "dopri5")
    ->Iterations(9)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_cost, chain_20_dopri853, bench::chain(20, 24), "dopri853")
    ->Iterations(9)
    ->Unit(benchmark::kMillisecond);
