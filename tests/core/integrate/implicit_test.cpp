// Implicit methods where they are meant for: stiff scenes; and what their stages promise.
#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "core/tableau/tableaus.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// A hinged rod whose damper decays at 3 c/(m l^2) = 3e4 1/s towards the slow fall under its weight.
Scene overdamped_rod() {
  Scene s;
  s.gravity = {0.0, -9.81, 0.0};
  Body rod = plain_body("rod", 1, {0.0, 1.0 / 12, 1.0 / 12, 0.0, 0.0, 0.0}, {0.5, 0.0, 0.0});
  s.bodies.push_back(rod);
  s.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "rod", vec("-0.5", "0", "0")));
  Rsda damper;
  damper.joint = "pin", damper.damping = 1e4;
  s.forces.push_back({"damper", damper});
  s.sensors.push_back(angle_sensor("angle", "pin"));
  s.simulation.end_time = 500;
  return s;
}

VectorXd one_step(const Scene& scene,
                  SimulationResult (*derivatives)(const Mechanism&, const SimulationSettings&, std::span<const Cost>)) {
  const Mechanism m(scene, nominal(scene));
  struct Linear final : PointCost {
    VectorXd weights;
    double value(const StatePoint& at) const override { return weights.dot(at.y); }
    double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut) const override {
      y_bar += scale * weights;
      return value(at);
    }
  };
  auto linear = std::make_shared<Linear>();
  linear->weights.resize(m.states());
  for (Eigen::Index i = 0; i < m.states(); ++i) linear->weights(i) = std::sin(1.0 + static_cast<double>(i));
  std::vector<Cost> costs(1);
  costs[0].terminal = linear;
  const SimulationResult run = derivatives(m, scene.simulation, costs);
  INFO(scene.simulation.integrator.type << ": " << run.message);
  REQUIRE(run.ok());
  return run.psi_rho.row(0);
}

}  // namespace

TEST_CASE("a stiff damper does not hold the steps of L-stable methods", "[implicit]") {
  Scene scene = overdamped_rod();
  for (const char* method : {"sdirk2", "sdirk3", "sdirk4", "lobatto3c", "rodas4", "radau5", "radau1a"}) {
    scene.simulation.integrator.type = method;
    const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
    INFO(method << ": " << run.message << " " << run.statistics.steps << " steps");
    REQUIRE(run.ok());
    CHECK(run.statistics.steps < 2000);  // an explicit one needs 500 s * 3e4/s / 3.3 = 4.5e6
    // Slow motion: c angle' = -m g (l/2) cos(angle), that is sinh(x) = -tan(angle), x = m g l t/(2 c), but for terms of
    // the size of 1/(decay rate) and the time of the decay.
    const double x = 9.81 * 0.5 * 500 / 1e4, angle = -std::atan(std::sinh(x));
    const Mechanism m(scene, nominal(scene));
    const double found = m.sensor_value(m.sensor("angle"), {500, run.y_end, VectorXd::Constant(1, angle), nullptr});
    CHECK(found == Approx(angle).margin(2e-5));
  }
}

// A bob on n massless rods of 1 m that are welded together, and on one of n metres.
TEST_CASE("rods without mass hold a bob as firmly as one does", "[implicit]") {
  const auto hung = [](int rods) {
    Scene s;
    s.gravity = {0.0, -9.81, 0.0};
    s.simulation.end_time = 2;
    const std::string length = std::to_string(10.0 / rods);
    std::string last = "ground";
    for (int k = 0; k <= rods; ++k) {
      Body rod = plain_body("b" + std::to_string(k), 0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {10.0 * k / rods, 0.0, 0.0});
      if (k == rods) rod.mass = 2, rod.inertia = {0.01, 0.01, 0.01, 0.0, 0.0, 0.0};
      Joint held =
          hinge("j" + std::to_string(k), last, vec(k == 0 ? "0" : length, "0", "0"), rod.name, vec("0", "0", "0"));
      if (k > 0) held.type = "fixed", held.axis1 = held.axis2 = {};
      s.bodies.push_back(rod), s.joints.push_back(held);
      last = rod.name;
    }
    return s;
  };
  for (const char* method : {"dopri853", "sdirk4", "radau5"}) {
    const auto run = [&](int rods) {
      Scene scene = hung(rods);
      scene.simulation.integrator.type = method;
      return simulate(Mechanism(scene, nominal(scene)), scene.simulation);
    };
    const SimulationResult one = run(1), ten = run(10);
    INFO(method << ": " << ten.message << ", steps " << ten.statistics.steps << ", of one rod "
                << one.statistics.steps);
    REQUIRE(one.ok());
    REQUIRE(ten.ok());
    CHECK(2 * ten.statistics.steps < 3 * one.statistics.steps);
    CHECK(ten.statistics.max_acceleration_residual < 1e-10);
    CHECK((ten.y_end.segment<3>(7 * 10) - one.y_end.segment<3>(7)).norm() < 1e-5);
  }
}

TEST_CASE("the adjoint identity holds to 1e-12 over one step of every method", "[implicit][gradient]") {
  Scene scene = every_force_four_bar();
  for (const Method& rk : runge_kutta_methods()) {
    scene.simulation.integrator.type = std::string(rk.name);
    for (const double h : {1e-3, 0.02}) {
      scene.simulation.end_time = h;
      scene.simulation.integrator.step = h;
      const VectorXd tlm = one_step(scene, [](const Mechanism&m, const SimulationSettings&s,
                                              std::span<const Cost> c) { return simulate_tlm(m, s, c); }),
                     adjoint = one_step(scene, [](const Mechanism&m, const SimulationSettings&s,
                                                  std::span<const Cost> c) { return simulate_adjoint(m, s, c); });
      INFO(rk.name << ", h = " << h);
      CHECK((tlm - adjoint).cwiseAbs().maxCoeff() < 1e-12 * tlm.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("steps that cannot be solved are made smaller, and said where they may not be", "[implicit]") {
  Scene scene = loaded_four_bar();
  scene.simulation.integrator.type = "radau5";
  scene.simulation.end_time = 2;
  scene.simulation.integrator.initial_step = 2;
  const SimulationResult adaptive = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  INFO(adaptive.message);
  CHECK(adaptive.ok());
  CHECK(adaptive.statistics.rejected > 0);
}

TEST_CASE("an implicit method converges at fixed steps that explicit ones cannot take", "[implicit]") {
  Scene scene = overdamped_rod();
  scene.simulation.end_time = 10;
  scene.simulation.integrator.step = 0.1;
  scene.simulation.integrator.type = "radau5";
  CHECK(simulate(Mechanism(scene, nominal(scene)), scene.simulation).ok());
  scene.simulation.integrator.type = "rk4";
  const SimulationResult with_rk4 = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  CHECK_FALSE(with_rk4.ok());
}
