// Solved runs through singular instants: values and gradients by the limit from both sides, or names of what has none.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/driven/kinematics.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;
using std::numbers::pi;

namespace {

// A parallelogram of cranks r, with the mass m of its coupler at B, driven at 2 rad/s from 0.7 rad. In line at theta =
// pi the weight asks for the torque
//
//   T = m g r cos(theta),   dT/dm = g r cos(theta),   dT/dr = m g cos(theta)
//
// The tension of the coupler has a pole in line if the right crank has a weight beside its hinge.
Scene parallelogram(const std::string& coupler = "0.9") {
  Scene s;
  add_parameters(s, {{"m", 1.3}, {"r", 0.4}, {"b", 0.9}, {"w", 2.0}});
  s.gravity = {0.0, -9.81, 0.0};
  const VectorField tip = vec("r", "0", "0"), origin = vec("0", "0", "0");
  s.bodies.push_back(plain_body("left", 1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, origin));
  s.bodies.push_back(plain_body("bar", 1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("r*cos(0.7)", "r*sin(0.7)", "0")));
  s.bodies.push_back(plain_body("right", 1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("0.9", "0", "0")));
  s.bodies[1].mass = f("m");
  for (const std::size_t i : {0u, 2u}) s.bodies[i].orientation = turned("0.7");
  s.joints.push_back(hinge("A", "ground", origin, "left", origin));
  s.joints.push_back(hinge("B", "left", tip, "bar", origin));
  s.joints.push_back(hinge("C", "bar", vec(coupler, "0", "0"), "right", tip));
  s.joints.push_back(hinge("D", "ground", vec("0.9", "0", "0"), "right", origin));
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "A", motor.law = f("0.7 + w*t");
  s.drives.push_back(motor);
  Sensor torque, pull;
  torque.name = "torque", torque.quantity = "drive_force", torque.drive = "motor";
  pull.name = "pull", pull.quantity = "reaction", pull.kind = "force", pull.joint = "C", pull.component = "x";
  s.sensors = {torque, angle_sensor("phi", "D"), angle_sensor("theta", "A"), pull};
  s.simulation.end_time = 3.5;  // past theta = pi and 2 pi
  return s;
}

const double kFlat = (pi - 0.7) / 2, kFlatAgain = (2 * pi - 0.7) / 2;

// Samples of torque^2 at these times, and its integral.
std::vector<Cost> torque_costs(const Mechanism& m, const std::vector<double>& times) {
  const auto square = std::make_shared<SensorProduct>(m, m.sensor("torque"), m.sensor("torque"));
  std::vector<Cost> costs(1);
  costs[0].running = square, costs[0].name = "squared";
  for (const double t : times) costs.emplace_back().samples = {{t, square}};
  return costs;
}

}  // namespace

TEST_CASE("the torque of a parallelogram in line is its limit, with its gradient, by TLM and adjoint", "[driven]") {
  const Scene scene = parallelogram();
  const Mechanism m(scene, nominal(scene), {true, true, false, true});
  const std::vector<double> times{kFlat, kFlat + 1e-7, kFlat - 3e-3, kFlatAgain, 2.0};
  const std::vector<Cost> costs = torque_costs(m, times);
  const SimulationResult tlm = simulate_tlm(m, scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(m, scene.simulation, costs);
  INFO(tlm.message << adjoint.message);
  REQUIRE((tlm.ok() && adjoint.ok()));
  for (std::size_t k = 0; k < times.size(); ++k) {
    const Eigen::Index o = static_cast<Eigen::Index>(k) + 1;
    const double th = 0.7 + 2 * times[k], T = 1.3 * 9.81 * 0.4 * std::cos(th), T_w = -1.3 * 9.81 * 0.4 * std::sin(th);
    CHECK(tlm.psi(o) == Approx(T * T).epsilon(1e-7));
    for (const auto& psi_rho : {tlm.psi_rho, adjoint.psi_rho}) {
      CHECK(psi_rho(o, 0) == Approx(2 * T * T / 1.3).epsilon(1e-6));
      CHECK(psi_rho(o, 1) == Approx(2 * T * T / 0.4).epsilon(1e-5));
      CHECK(psi_rho(o, 3) == Approx(2 * T * T_w * times[k]).epsilon(1e-5).margin(1e-5));
    }
  }
  const double whole = std::pow(1.3 * 9.81 * 0.4, 2) * (3.5 / 2 + (std::sin(2 * 7.7) - std::sin(1.4)) / 8);
  CHECK(tlm.psi(0) == Approx(whole).epsilon(1e-7));
  CHECK(tlm.psi_rho(0, 0) == Approx(2 * whole / 1.3).epsilon(1e-6));
  CHECK((tlm.psi_rho - adjoint.psi_rho).cwiseAbs().maxCoeff() < 1e-6 * adjoint.psi_rho.cwiseAbs().maxCoeff());
  CHECK(tlm.statistics.singular.empty());
}

TEST_CASE("a parallelogram keeps its branch wherever rows lie, in simulate and kinematics", "[driven]") {
  const Scene scene = parallelogram();
  const Mechanism m(scene, nominal(scene));
  std::vector<double> times{0, kFlat - 1e-9, kFlat, kFlat + 1e-5, kFlat + 2e-3, kFlatAgain - 1e-4, kFlatAgain, 3.5};
  double apart = 0, off = 0;
  const auto look = [&](std::size_t, const StatePoint& at) {
    apart = std::max(apart, std::abs(m.sensor_value(1, at) - m.sensor_value(2, at)));
    off = std::max(off, std::abs(m.sensor_value(0, at) - 1.3 * 9.81 * 0.4 * std::cos(0.7 + 2 * at.t)));
    return true;
  };
  CHECK(simulate(m, scene.simulation, {}, {times, look}).ok());
  CHECK(solve_kinematics(m, Assembly(m, 0), scene.simulation, times, look).ok());
  CHECK(apart < 1e-7);
  CHECK(off < 1e-6);
}

TEST_CASE("a tension without a limit is left out and named, and a parameter that prevents the passage", "[driven]") {
  Scene scene = parallelogram("b");
  scene.bodies[2].com = vec("0.2", "0", "0");
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs = torque_costs(m, {kFlat});
  bool has_value = true;
  const SimulationResult run =
      simulate(m, scene.simulation, {},
               {{kFlat}, [&](std::size_t, const StatePoint& at) { has_value = std::isfinite(m.sensor_value(3, at)); }});
  REQUIRE(run.ok());
  CHECK_FALSE(has_value);
  REQUIRE(run.statistics.singular.size() == 1);
  const SingularPosition& s = run.statistics.singular.front();
  CHECK(s.t == Approx(kFlat).margin(1e-5));
  CHECK(s.lacking == std::vector<std::string>{"sensor 'pull'"});
  CHECK(std::ranges::find(s.owners, "joint 'C'") != s.owners.end());
  for (const SimulationResult& differentiated :
       {simulate_tlm(m, scene.simulation, costs), simulate_adjoint(m, scene.simulation, costs)}) {
    REQUIRE(differentiated.ok());
    REQUIRE_FALSE(differentiated.statistics.singular.empty());
    CHECK(std::ranges::any_of(differentiated.statistics.singular,
                              [](const SingularPosition& p) { return std::ranges::count(p.parameters, 2) > 0; }));
  }
  costs[1].samples[0].cost = std::make_shared<SensorProduct>(m, 3, 3);
  CHECK_THAT(simulate(m, scene.simulation, costs).message, Catch::Contains("singular position at t = 1.22"));
}

TEST_CASE("a bushing that drives turn by half a turn ends solved runs by its name", "[driven]") {
  Scene s;
  s.bodies.push_back(plain_body("block", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "block", vec("0", "0", "0")));
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "A", motor.law = f("7*t");
  s.drives.push_back(motor);
  BushingSpec rubber;
  rubber.body2 = "block", rubber.torsional_stiffness = vec("5", "5", "5");
  s.forces.push_back({"rubber", rubber});
  s.simulation.end_time = 2;
  const Mechanism m(s, VectorXd());
  const SimulationResult run = simulate(m, s.simulation, {});
  CHECK(run.status == SimulationStatus::not_credible);
  CHECK_THAT(run.message, Catch::Contains("the bushing between 'ground' and 'block', is turned by 3.1"));
  CHECK(run.last_good_time == Approx(3.13 / 7).margin(1e-3));
  const SimulationResult kinematics =
      solve_kinematics(m, Assembly(m, 0), s.simulation, {0, 1, 2}, [](std::size_t, const StatePoint&) {});
  CHECK_THAT(kinematics.message, Catch::Contains("the bushing between 'ground' and 'block'"));
}
