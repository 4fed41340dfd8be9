// Cost of gradients in simulations as the mechanism grows, with 50 parameters, by an explicit and by implicit methods:
// chains of rods in space (masses and lengths, spread over the rods) and N-four-bars (masses, centres of mass,
// inertias) in gravity turned upwards, so that they swing about the upright and never come to their singular position.
//   adjoint_ratio          adjoint / simulation, both with compilation and assembly
//   tlm_per_parameter      what each parameter beyond the first adds to TLM, in simulations: (TLM of 50 - TLM of 1)/49
//   tlm_of_one, tlm_of_all TLM of 1 and of 50 parameters, in simulations
//   start_share            of one simulation, what its compilation and assembly take
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "bench/linkage.hpp"
#include "core/start/assembly.hpp"
#include "optim/check/gradient_timing.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/objective.hpp"

using namespace mbsopt;

namespace {

constexpr int kParameters = 50;

// "0.3" for a rod without parameters, else the mean of its own among so many.
Expression mean_of(char name, int parameters, int rod, int rods, double otherwise) {
  std::string sum;
  int count = 0;
  for (int k = rod; k < parameters; k += rods, ++count) sum += fmt::format("{}{}{}", count ? " + " : "", name, k);
  return Expression::parse(count ? fmt::format("({})/{}", sum, count) : fmt::format("{}", otherwise));
}

Scene chain(int rods, int parameters) {
  Scene scene;
  scene.gravity = {0.0, 0.0, -9.81};
  const int masses = (parameters + 1) / 2, lengths = parameters / 2;
  for (int k = 0; k < parameters; ++k) {
    Parameter p;
    p.name = fmt::format("{}{}", k < masses ? 'm' : 'l', k < masses ? k : k - masses);
    p.value = k < masses ? 0.3 : 0.2;
    p.allow_unused = true;  // the length of the last rod
    scene.parameters.push_back(p);
  }
  for (int i = 0; i < rods; ++i) {
    Body rod;
    rod.name = fmt::format("rod{}", i);
    rod.mass = mean_of('m', masses, i, rods, 0.3);
    rod.com = {0.1, 0.0, 0.0};
    rod.inertia = {2e-4, 1e-3, 1e-3, 0.0, 0.0, 0.0};
    rod.position = {0.2 * i, 0.0, 0.0};
    scene.bodies.push_back(rod);
    Joint hinge;
    hinge.name = fmt::format("hinge{}", i), hinge.type = "revolute";
    hinge.body1 = i == 0 ? "ground" : fmt::format("rod{}", i - 1), hinge.body2 = rod.name;
    hinge.point1 = i == 0 ? VectorField{0.0, 0.0, 0.0} : VectorField{mean_of('l', lengths, i - 1, rods, 0.2), 0.0, 0.0};
    hinge.point2 = VectorField{0.0, 0.0, 0.0};
    hinge.axis1 = hinge.axis2 = i % 2 == 0 ? VectorField{0.0, 1.0, 0.0} : VectorField{0.0, 0.0, 1.0};
    scene.joints.push_back(hinge);
  }
  Sensor height;
  height.name = "height", height.quantity = "position", height.component = "z";
  height.body = fmt::format("rod{}", rods - 1);
  scene.sensors.push_back(height);
  scene.simulation.end_time = rods <= 100 ? 1 : 3;  // the start of many rods costs more than some steps
  scene.simulation.integrator.rtol = 1e-6, scene.simulation.integrator.atol = 1e-8;
  return scene;
}

// Every parameter is a field of one body: of each the first, then of each the second, ...
Scene windows(int count, int parameters) {
  const bench::Linkage linkage = bench::four_bars(count);
  Scene scene = bench::scene_of(linkage);
  const int bodies = linkage.size();
  for (int k = 0; k < parameters; ++k) {
    Body& body = scene.bodies[static_cast<std::size_t>(bodies < kParameters ? k % bodies : k * bodies / kParameters)];
    InertiaField& J = body.inertia;
    Expression* const fields[] = {&body.mass, &body.com[0], &body.com[1], &J.zz, &J.xx,
                                  &J.yy,      &body.com[2], &J.xy,        &J.xz, &J.yz};
    Expression& field = *fields[bodies < kParameters ? k / bodies : k % 4];
    Parameter p;
    p.name = fmt::format("p{}", k);
    p.value = field.number();
    field = Expression::parse(p.name);
    scene.parameters.push_back(p);
  }
  Sensor height;
  height.name = "height", height.quantity = "position", height.component = "y", height.body = "rod0";
  scene.sensors.push_back(height);
  scene.gravity = {0.0, 9.81, 0.0};
  scene.simulation.end_time = 5;
  scene.simulation.integrator.rtol = 1e-6, scene.simulation.integrator.atol = 1e-8;
  return scene;
}

GradientTiming timed(Scene scene, const char* method) {
  scene.simulation.integrator.type = method;
  ObjectiveSpec spec;
  spec.name = "sag", spec.running = Expression::parse("height^2");
  const std::vector<Objective> objectives{Objective(scene, spec)};
  GradientTimingOptions options;
  options.most_seconds = 100;  // two rounds of 500 rods
  return time_gradients(scene, objectives, options);
}

void gradient_scaling(benchmark::State& state, const char* method, Scene (*make)(int size, int parameters)) {
  const int size = static_cast<int>(state.range(0));
  const Scene scene = make(size, kParameters);
  for (auto _ : state) {
    const GradientTiming timing = timed(scene, method), of_one = timed(make(size, 1), method);
    if (!timing.ok || !of_one.ok) {
      state.SkipWithError((timing.message + of_one.message).c_str());
      return;
    }
    Eigen::VectorXd rho(kParameters);
    for (int k = 0; k < kParameters; ++k) rho(k) = scene.parameters[static_cast<std::size_t>(k)].value;
    const Stopwatch clock;
    Assembly(Mechanism(scene, rho), 0);
    state.counters["start_share"] = clock.seconds() / timing.simulation.wall_seconds;
    state.counters["bodies"] = static_cast<double>(scene.bodies.size());
    state.counters["steps"] = static_cast<double>(timing.steps);
    state.counters["rounds"] = timing.rounds;
    state.counters["adjoint_ratio"] = timing.adjoint.ratio;
    state.counters["tlm_of_all"] = timing.tlm.ratio;
    state.counters["tlm_of_one"] = of_one.tlm.ratio;
    state.counters["tlm_per_parameter"] = (timing.tlm.ratio - of_one.tlm.ratio) / (kParameters - 1);
  }
}

}  // namespace

#define MBSOPT_GRADIENT_SCALING(mechanism, method, ...)                         \
  BENCHMARK_CAPTURE(gradient_scaling, mechanism##_##method, #method, mechanism) \
      ->ArgsProduct({{__VA_ARGS__}})                                            \
      ->Iterations(1)                                                           \
      ->Unit(benchmark::kMillisecond)

MBSOPT_GRADIENT_SCALING(chain, dopri5, 1, 5, 21, 81, 100, 500);
MBSOPT_GRADIENT_SCALING(windows, dopri5, 2, 10, 40, 250);
MBSOPT_GRADIENT_SCALING(chain, dopri853, 1, 5, 21, 81, 100);
MBSOPT_GRADIENT_SCALING(chain, radau5, 1, 5, 21, 100);
MBSOPT_GRADIENT_SCALING(chain, sdirk4, 1, 5, 21, 100);
