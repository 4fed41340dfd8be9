// Laws that jump at a declared time: a step ends there, and nothing of a method's order or of a gradient is lost.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

constexpr double kEvent = 0.2341;

// A torque that changes its sign at kEvent, where it has no value, and a sample just there.
Scene with_jump() {
  Scene s = double_pendulum();
  add_parameters(s, {{"push", 4.0}});
  s.gravity = {0.0, -9.81, 0.0};
  Torque motor;
  motor.body = "upper", motor.components = {f("0"), f("0"), f("push*abs(t - 0.2341)/(t - 0.2341)")};
  s.forces.push_back({"motor", motor});
  s.simulation.end_time = 0.5;
  s.simulation.events = {kEvent};
  return s;
}

// A drive whose acceleration jumps.
Scene with_kink_of_a_drive() {
  Scene s = double_pendulum();
  add_parameters(s, {{"push", 4.0}});
  s.gravity = {0.0, -9.81, 0.0};
  Drive d;
  d.name = "motor", d.type = "angle", d.joint = "A", d.law = f("0.9 + 0.8*t + push*max(0, t - 0.2341)^2");
  s.drives.push_back(d);
  s.simulation.end_time = 0.5;
  s.simulation.events = {kEvent};
  return s;
}

std::vector<Cost> costs() {
  Cost cost;
  cost.running = cost.terminal = std::make_shared<StateNorm>();
  cost.samples = {{kEvent, std::make_shared<StateNorm>()}, {0.3, std::make_shared<StateNorm>()}};
  return {cost};
}

SimulationResult run(Scene scene, const std::string& method, int steps) {
  scene.simulation.integrator.type = method;
  scene.simulation.integrator.step = scene.simulation.end_time / steps;
  const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  REQUIRE(result.ok());
  return result;
}

}  // namespace

TEST_CASE("a jump leaves a method its order, declared or not", "[events]") {
  Scene scene = GENERATE(with_jump(), with_kink_of_a_drive());
  const auto [method, order, steps] =
      GENERATE(std::tuple("bs3", 3, 128), std::tuple("rk4", 4, 64), std::tuple("dopri5", 5, 32));
  const VectorXd exact = run(scene, "dopri853", 200).y_end;
  const double coarse = (run(scene, method, steps).y_end - exact).norm();
  const double fine = (run(scene, method, 2 * steps).y_end - exact).norm();
  scene.simulation.events = {};
  const double found = (run(scene, method, 2 * steps).y_end - exact).norm();
  INFO(method << ": errors " << coarse << ", " << fine << "; not declared " << found);
  CHECK(std::log2(coarse / fine) == Approx(order).margin(0.35));
  CHECK(found == Approx(fine).epsilon(0.01));
}

TEST_CASE("no step crosses an event, and the next one begins there", "[events]") {
  Scene scene = with_jump();
  scene.simulation.events = {0.4, kEvent, kEvent};  // in any order
  if (GENERATE(true, false)) {
    scene.simulation.integrator.type = "rk4", scene.simulation.integrator.step = 0.01;
  }
  const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  REQUIRE(result.ok());
  for (const double event : {kEvent, 0.4}) {
    bool begins = false;
    for (std::size_t i = 0; i < result.steps.times.size(); ++i) {
      const double t = result.steps.times[i], t1 = t + result.steps.sizes[i];
      CHECK((t1 < event || t > event));
      begins = begins || (t > event && t - event < 1e-14);
    }
    CHECK(begins);
  }
  CHECK(result.steps.times.back() + result.steps.sizes.back() == Approx(0.5).epsilon(1e-15));
}

TEST_CASE("a step whose end meets the event by chance is not followed by a tiny one", "[events]") {
  Scene scene = double_pendulum();
  scene.simulation.end_time = 0.5;
  scene.simulation.events = {0.25};
  scene.simulation.integrator.type = "rk4", scene.simulation.integrator.step = 0.01;
  const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  REQUIRE(result.ok());
  CHECK(result.statistics.steps == 50);
}

TEST_CASE("step-size control finds a jump of time as if it were declared", "[events]") {
  Scene scene = with_jump();
  scene.simulation.integrator.rtol = 1e-9, scene.simulation.integrator.atol = 1e-11;
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult declared = simulate(mechanism, scene.simulation);
  scene.simulation.events = {};
  const SimulationResult hidden = simulate(mechanism, scene.simulation);
  INFO(declared.statistics.steps << " and " << hidden.statistics.steps << " steps");
  REQUIRE((declared.ok() && hidden.ok()));
  CHECK(hidden.statistics.rejected <= declared.statistics.rejected);
  CHECK(hidden.statistics.rhs_evaluations <= declared.statistics.rhs_evaluations);
}

TEST_CASE("gradients are exact across events", "[events]") {
  Scene scene = GENERATE(with_jump(), with_kink_of_a_drive());
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, costs());
  const SimulationResult tlm = simulate_tlm(mechanism, scene.simulation, costs());
  REQUIRE((adjoint.ok() && tlm.ok()));
  const double size = tlm.psi_rho.cwiseAbs().maxCoeff();
  CHECK((adjoint.psi_rho - tlm.psi_rho).cwiseAbs().maxCoeff() < 1e-10 * size);
  RunOptions frozen;
  frozen.frozen = &adjoint.steps;
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const double d = 1e-5;
    auto psi = [&](double shift) {
      VectorXd at = rho;
      at(k) += shift;
      return simulate(Mechanism(scene, at), scene.simulation, costs(), {}, frozen).psi(0);
    };
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    CHECK(adjoint.psi_rho(0, k) == Approx((psi(d) - psi(-d)) / (2 * d)).margin(1e-7 * size));
  }
  scene.simulation.adjoint_memory_mib = 1e-6;
  const SimulationResult bound = simulate_adjoint(mechanism, scene.simulation, costs());
  REQUIRE(bound.ok());
  CHECK(bound.statistics.recomputed_steps > 0);
  CHECK(bound.psi_rho == adjoint.psi_rho);
}

TEST_CASE("states of rejected steps do not count among the accelerations that were not met", "[events]") {
  Scene scene = double_pendulum();
  add_parameters(scene, {{"a", 0.4}});
  scene.gravity = {0.0, -9.81, 0.0};
  Drive drive;
  const double begin = 0.1 * GENERATE(range(5, 16));
  const std::string u = "min(1, max(0, (t - " + std::to_string(begin) + ")/0.1))";
  drive.name = "motor", drive.type = "angle", drive.joint = "A";
  drive.law = f("theta0 - 0.6 + a*(" + u + ")^3*(10 - 15*" + u + " + 6*(" + u + ")^2)");
  scene.drives = {drive};
  scene.simulation.end_time = 3;
  scene.simulation.integrator.type = "dopri853";
  scene.simulation.integrator.rtol = 1e-8, scene.simulation.integrator.atol = 1e-8;
  const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  REQUIRE(result.ok());
  CHECK(result.statistics.rejected > 0);
  CHECK(result.statistics.max_acceleration_residual < 1e-10);
}
