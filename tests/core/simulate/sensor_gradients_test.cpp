// Sensors that are expressions of others, and inertial measurement units, in costs and forces of whole simulations: TLM
// against adjoint, and both against differences on frozen steps.
#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

Scene measured_four_bar() {
  Scene s = every_force_four_bar();
  s.simulation.end_time = 0.15;
  const char* const components[] = {"ax", "wz"};
  for (const char* component : components) {
    Sensor imu = point_sensor(component, "imu", "coupler", vec("c2", "off", "0.1"), component);
    imu.axes = RollPitchYawField{vec("mu", "0.3", "L3")};
    s.sensors.push_back(imu);
  }
  s.sensors.insert(s.sensors.begin(), expression_sensor("mixed", "bent*ax/10 + mu*cos(t)"));
  s.sensors.push_back(expression_sensor("bent", "angle + push*z*wz"));
  Torque servo;
  servo.body = "rocker", servo.components = {f("0"), f("0.2*wz"), f("-kt*bent - 0.1*bent^2")};
  s.forces.push_back({"held", servo});
  return s;
}

std::vector<Cost> costs_of(const Mechanism& m) {
  const int mixed = m.sensor("mixed"), bent = m.sensor("bent"), ax = m.sensor("ax");
  std::vector<Cost> list(2);
  list[0].running = std::make_shared<SensorProduct>(m, mixed, bent);
  list[0].terminal = std::make_shared<SensorProduct>(m, ax, bent);
  list[1].running = std::make_shared<SensorProduct>(m, ax, ax);
  list[1].samples = {{0.07, std::make_shared<SensorProduct>(m, mixed, ax)}};
  return list;
}

}  // namespace

TEST_CASE("gradients through expressions of sensors and imu: TLM, adjoint and differences agree", "[gradient]") {
  Scene scene = measured_four_bar();
  scene.simulation.integrator.type = GENERATE(as<std::string>{}, "dopri5", "radau5");
  const VectorXd rho = nominal(scene);
  const Mechanism m(scene, rho);
  const SimulationResult tlm = simulate_tlm(m, scene.simulation, costs_of(m));
  const SimulationResult adjoint = simulate_adjoint(m, scene.simulation, costs_of(m));
  INFO(tlm.message << adjoint.message);
  REQUIRE((tlm.ok() && adjoint.ok()));
  CHECK(tlm.psi == adjoint.psi);
  const double size = tlm.psi_rho.cwiseAbs().maxCoeff();
  const RunOptions frozen{&adjoint.steps, {}};
  const auto psi = [&](const VectorXd& at) {
    const Mechanism moved(scene, at);
    const SimulationResult run = simulate(moved, scene.simulation, costs_of(moved), {}, frozen);
    REQUIRE(run.ok());
    return run.psi;
  };
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const double h = 2e-4 * std::max(1.0, std::abs(rho(k)));
    const auto difference = [&](double step) {
      VectorXd up = rho, down = rho;
      up(k) += step, down(k) -= step;
      return VectorXd((psi(up) - psi(down)) / (2 * step));
    };
    const VectorXd extrapolated = (4 * difference(h / 2) - difference(h)) / 3;
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    for (Eigen::Index o = 0; o < 2; ++o) {  // tolerances as in gradients_test.cpp
      const double scale = std::max(std::abs(tlm.psi_rho(o, k)), 1e-3 * size);
      CHECK(std::abs(tlm.psi_rho(o, k) - adjoint.psi_rho(o, k)) <= 1e-10 * scale);
      CHECK(std::abs(extrapolated(o) - adjoint.psi_rho(o, k)) <= 1e-7 * scale);
    }
  }
}
