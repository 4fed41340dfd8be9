#include "core/simulate/simulation.hpp"

#include <catch2/catch.hpp>

#include "core/body/euler_parameters.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

TEST_CASE("a torque-free body keeps its energy and its angular momentum", "[simulation]") {
  Scene scene;
  scene.gravity = {0.0, 0.0, 0.0};
  Body b = body("top", vec("0", "0", "0"), vec("0", "0", "0"), turned("0.3"));
  b.angular_velocity = {0.1, 6.0, 0.2};  // about the middle axis: it tumbles
  scene.bodies.push_back(b);
  scene.simulation.end_time = 20;
  IntegratorSettings& integrator = scene.simulation.integrator;
  integrator.type = "dopri853", integrator.rtol = 1e-10, integrator.atol = 1e-12;
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult run = simulate(mechanism, scene.simulation);
  REQUIRE(run.ok());
  CHECK(run.statistics.energy_drift < 1e-8 * run.statistics.energy_initial);
  auto momentum = [&](const VectorXd& y) {
    const Vector4d p = y.segment<4>(3), pdot = y.segment<4>(10);
    return Vector3d(A(p) * (mechanism.data().bodies[1].J * omega_B(p, pdot)));
  };
  CHECK((momentum(run.y_end) - momentum(run.y_initial)).norm() < 1e-8 * momentum(run.y_initial).norm());
}

TEST_CASE("an angle is counted over many turns", "[simulation]") {
  Scene scene = pendulum();
  scene.gravity = {0.0, 0.0, 0.0};
  scene.conditions = {value_of("theta", "theta0"), rate_of("theta", "40")};
  scene.simulation.end_time = 10;
  const Mechanism mechanism(scene, nominal(scene));
  double last = 0;
  Sampling sampling{{0.0, 3.0, 10.0}, [&](std::size_t, const StatePoint& at) { last = mechanism.sensor_value(0, at); }};
  REQUIRE(simulate(mechanism, scene.simulation, {}, sampling).ok());
  CHECK(last == Approx(0.4 + 400).epsilon(1e-6));
}

TEST_CASE("samples never change the steps", "[simulation]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.3;
  const Mechanism mechanism(scene, nominal(scene));
  int seen = 0;
  Sampling sampling;
  for (int i = 0; i <= 300; ++i) sampling.times.push_back(0.001 * i);
  sampling.observe = [&](std::size_t, const StatePoint&) { ++seen; };
  const SimulationResult with = simulate(mechanism, scene.simulation, {}, sampling);
  const SimulationResult without = simulate(mechanism, scene.simulation);
  CHECK(seen == 301);
  CHECK(with.steps.times == without.steps.times);
  CHECK(with.y_end == without.y_end);
}

TEST_CASE("what goes wrong is said with the time and what to try", "[simulation]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 5;
  const Mechanism mechanism(scene, nominal(scene));
  SimulationSettings s = scene.simulation;
  s.integrator.max_steps = 10;
  SimulationResult run = simulate(mechanism, s);
  CHECK(run.status == SimulationStatus::too_many_steps);
  CHECK(run.message.find("max_steps") != std::string::npos);
  CHECK(run.last_good_time > 0);

  s = scene.simulation;
  s.integrator.type = "rk4", s.integrator.step = 1.0;
  s.formulation.projection = Projection::none;
  run = simulate(mechanism, s);
  CHECK(run.status != SimulationStatus::ok);
  CHECK(run.message.find("step") != std::string::npos);

  Scene open = four_bar();
  open.parameters[1].value = 5;  // a coupler of 5 m closes no loop of bars of 0.5 m and 0.9 m
  run = simulate(Mechanism(open, nominal(open)), open.simulation);
  CHECK(run.status == SimulationStatus::assembly_failed);
  CHECK_FALSE(run.message.empty());

  run = simulate(mechanism, scene.simulation, {}, {}, {nullptr, [](double t) { return t < 0.1; }});
  CHECK(run.status == SimulationStatus::stopped);
  CHECK(run.last_good_time >= 0.1);
}

TEST_CASE("an adjoint run is stopped on its way back, too", "[simulation]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.3;
  const Mechanism mechanism(scene, nominal(scene));
  int on_the_way_back = -1;  // the first call at the end is of the last step
  const SimulationResult run = simulate_adjoint(mechanism, scene.simulation, {}, {nullptr, [&](double t) {
                                                                                    if (t == 0.3) ++on_the_way_back;
                                                                                    return on_the_way_back < 2;
                                                                                  }});
  CHECK(run.status == SimulationStatus::stopped);
  CHECK(run.message.find("in the backward run") != std::string::npos);
  CHECK(on_the_way_back == 2);
}

TEST_CASE("an adjoint run asks whether to go on while it computes steps again", "[simulation]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.3;
  scene.simulation.integrator.step = 1e-4;
  scene.simulation.adjoint_memory_mib = 1e-3;
  const Mechanism mechanism(scene, nominal(scene));
  long asked = -1;  // the first call at the end is of the last step
  const SimulationResult run = simulate_adjoint(mechanism, scene.simulation, {}, {nullptr, [&](double t) {
                                                                                    if (t == 0.3) ++asked;
                                                                                    return true;
                                                                                  }});
  REQUIRE(run.ok());
  REQUIRE(run.statistics.recomputed_steps > run.statistics.steps);
  CHECK(asked >= run.statistics.steps + run.statistics.recomputed_steps / 256);
}

TEST_CASE("a fixed step divides the span evenly", "[simulation]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.3;
  scene.simulation.integrator.type = "rk4", scene.simulation.integrator.step = 0.001;
  const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  REQUIRE(run.ok());
  CHECK(run.statistics.steps == 300);
  CHECK(run.last_good_time == 0.3);
}

TEST_CASE("the first step is initial_step, and none is longer than max_step", "[simulation]") {
  const Scene scene = point_pendulum();
  SimulationSettings settings = scene.simulation;
  settings.integrator.initial_step = 1e-3, settings.integrator.max_step = 4e-3;
  settings.integrator.rtol = settings.integrator.atol = 1e-3;  // alone it would allow longer ones
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), settings);
  REQUIRE(run.ok());
  const std::vector<double>& h = run.steps.sizes;
  CHECK(h.front() == 1e-3);
  CHECK(*std::max_element(h.begin(), h.end()) == 4e-3);
}

TEST_CASE("a body that nothing gives inertia is named", "[simulation]") {
  Scene scene;
  scene.bodies.push_back(plain_body("ghost", 0, {}, {0.0, 0.0, 0.0}));
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), scene.simulation);
  CHECK(run.status == SimulationStatus::not_finite);
  CHECK(run.message.find("'ghost'") != std::string::npos);
}

TEST_CASE("after each accepted step the state is shown, the last one that of the end", "[integrate]") {
  const Scene scene = point_pendulum();
  SimulationSettings settings = scene.simulation;
  settings.end_time = 0.5;
  const Mechanism mechanism(scene, Eigen::VectorXd());
  std::vector<double> times;
  Eigen::VectorXd last;
  RunOptions options;
  options.after_step = [&](const StatePoint& at) { times.push_back(at.t), last = at.y; };
  const SimulationResult run = simulate(mechanism, settings, {}, {}, options);
  REQUIRE(run.ok());
  CHECK(static_cast<long>(times.size()) == run.statistics.steps);
  CHECK(std::is_sorted(times.begin(), times.end()));
  CHECK(times.back() == 0.5);
  CHECK(last == run.y_end);
}

TEST_CASE("tolerances below the rounding errors of numbers are what a run fails by, and its message says so",
          "[simulation]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 1;
  const Mechanism mechanism(scene, nominal(scene));
  const std::string type = GENERATE("dopri5", "dopri853", "radau5");
  const double tolerance = GENERATE(0.0, 1e-300, 1e-30);
  INFO(type << " at " << tolerance);
  SimulationSettings s = scene.simulation;
  s.integrator = {};
  s.integrator.type = type, s.integrator.rtol = s.integrator.atol = tolerance, s.integrator.max_steps = 2000;
  const SimulationResult run = simulate(mechanism, s);
  REQUIRE_FALSE(run.ok());
  CHECK(run.message.find("ask for more digits") != std::string::npos);
  CHECK(run.message.find("nan") == std::string::npos);
  CHECK(run.message.find("end_time") == std::string::npos);
}
