// Cost of gradients in simulations as the mechanism grows: chains of 1, 5, 20 and 100 rods in space with 20 parameters
// (masses and lengths, spread over the rods), by an explicit and by implicit methods.
//   adjoint_ratio, tlm_per_parameter: as in gradient_cost_benchmark.cpp
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "optim/gradient_timing.hpp"
#include "optim/objective.hpp"

using namespace mbsopt;

namespace {

constexpr int kParameters = 20;

// "0.3" for a rod without parameters, else the mean of its own.
Expression mean_of(char name, int rod, int rods, double otherwise) {
  std::string sum;
  int count = 0;
  for (int k = rod; k < kParameters / 2; k += rods, ++count) sum += fmt::format("{}{}{}", count ? " + " : "", name, k);
  return Expression::parse(count ? fmt::format("({})/{}", sum, count) : fmt::format("{}", otherwise));
}

Scene chain(int rods) {
  Scene scene;
  scene.gravity = {0.0, 0.0, -9.81};
  for (int k = 0; k < kParameters; ++k) {
    Parameter p;
    p.name = fmt::format("{}{}", k < kParameters / 2 ? 'm' : 'l', k % (kParameters / 2));
    p.value = k < kParameters / 2 ? 0.3 : 0.2;
    scene.parameters.push_back(p);
  }
  for (int i = 0; i < rods; ++i) {
    Body rod;
    rod.name = fmt::format("rod{}", i);
    rod.mass = mean_of('m', i, rods, 0.3);
    rod.com = {0.1, 0.0, 0.0};
    rod.inertia = {2e-4, 1e-3, 1e-3, 0.0, 0.0, 0.0};
    rod.position = {0.2 * i, 0.0, 0.0};
    scene.bodies.push_back(rod);
    Joint hinge;
    hinge.name = fmt::format("hinge{}", i), hinge.type = "revolute";
    hinge.body1 = i == 0 ? "ground" : fmt::format("rod{}", i - 1), hinge.body2 = rod.name;
    hinge.point1 = i == 0 ? VectorField{0.0, 0.0, 0.0} : VectorField{mean_of('l', i - 1, rods, 0.2), 0.0, 0.0};
    hinge.point2 = VectorField{0.0, 0.0, 0.0};
    hinge.axis1 = hinge.axis2 = i % 2 == 0 ? VectorField{0.0, 1.0, 0.0} : VectorField{0.0, 0.0, 1.0};
    scene.joints.push_back(hinge);
  }
  Sensor height;
  height.name = "height", height.quantity = "position", height.component = "z";
  height.body = fmt::format("rod{}", rods - 1);
  scene.sensors.push_back(height);
  scene.simulation.end_time = rods < 100 ? 0.3 : 1.5;  // the start of many rods costs more than some steps
  scene.simulation.integrator.rtol = 1e-6, scene.simulation.integrator.atol = 1e-8;
  return scene;
}

void gradient_scaling(benchmark::State& state, const char* method) {
  const int rods = static_cast<int>(state.range(0));
  Scene scene = chain(rods);
  scene.simulation.integrator.type = method;
  ObjectiveSpec spec;
  spec.name = "sag", spec.running = Expression::parse("height^2");
  const std::vector<Objective> objectives{Objective(scene, spec)};
  for (auto _ : state) {
    const GradientTiming timing = time_gradients(scene, objectives);
    if (!timing.ok) {
      state.SkipWithError(timing.message.c_str());
      return;
    }
    state.counters["steps"] = static_cast<double>(timing.steps);
    state.counters["rhs_us_per_body"] =
        1e6 * timing.simulation.wall_seconds / static_cast<double>(timing.rhs_evaluations) / rods;
    state.counters["adjoint_ratio"] = timing.adjoint.ratio;
    state.counters["tlm_per_parameter"] = (timing.tlm.ratio - 1) / kParameters;
  }
}

}  // namespace

#define MBSOPT_GRADIENT_SCALING(method)                \
  BENCHMARK_CAPTURE(gradient_scaling, method, #method) \
      ->Arg(1)                                         \
      ->Arg(5)                                         \
      ->Arg(20)                                        \
      ->Arg(100)                                       \
      ->Iterations(1)                                  \
      ->Unit(benchmark::kMillisecond)

MBSOPT_GRADIENT_SCALING(dopri5);
MBSOPT_GRADIENT_SCALING(dopri853);
MBSOPT_GRADIENT_SCALING(radau5);
MBSOPT_GRADIENT_SCALING(sdirk4);
