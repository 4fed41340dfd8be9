#include "core/mechanism/rounded_loops.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "core/mechanism/mechanism_data.hpp"
#include "core/simulate/simulation.hpp"
#include "core/start/assembly.hpp"
#include "core/start/model_warnings.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The four-bar swings under gravity. "out" moves the rocker's foot out of the plane, "tilt" turns an axis of hinge C.
Scene rounded_four_bar(double out, double tilt) {
  Scene scene = four_bar();
  add_parameters(scene, {{"out", out}, {"tilt", tilt}});
  scene.gravity = {0.0, -9.81, 0.0};
  scene.joints[3].point1 = vec("d", "0", "out");
  scene.joints[2].axis1 = vec("tilt", "0", "1");
  scene.simulation.integrator.rtol = 1e-10, scene.simulation.integrator.atol = 1e-12;
  return scene;
}

// The square of the crank's angle after 1 s, and its derivatives in the parameters of four_bar().
SimulationResult swing(const Scene& scene, bool adjoint) {
  std::vector<bool> active(scene.parameters.size(), true);
  active[7] = active[8] = false;
  const Mechanism mechanism(scene, nominal(scene), active);
  Cost cost;
  cost.terminal = std::make_shared<SensorProduct>(mechanism, 0, 0);
  return adjoint ? simulate_adjoint(mechanism, scene.simulation, {&cost, 1})
                 : simulate_tlm(mechanism, scene.simulation, {&cost, 1});
}

RoundedLoops found_in(const Scene& scene) { return Mechanism(scene, nominal(scene)).data().rounded; }

}  // namespace

TEST_CASE("a planar loop with rounded numbers moves as the exact one, in value and gradient", "[rounded_loops]") {
  const SimulationResult exact = swing(rounded_four_bar(0, 0), true);
  REQUIRE(exact.ok());
  CHECK(found_in(rounded_four_bar(0, 0)).joints.empty());
  const double e = GENERATE(1e-10, 1e-8, 1e-6, 6e-6);
  const bool point = GENERATE(true, false);
  const Scene scene = point ? rounded_four_bar(e, 0) : rounded_four_bar(0, e);
  CAPTURE(e, point);
  const RoundedLoops found = found_in(scene);
  CHECK(found.made);
  CHECK(std::max(found.shift, found.turn) < e);
  for (const bool adjoint : {true, false}) {
    const SimulationResult run = swing(scene, adjoint);
    INFO(run.message);
    REQUIRE(run.ok());
    CHECK(run.statistics.max_position_violation < 1e-14);
    CHECK(std::abs(run.psi(0) - exact.psi(0)) < 30 * e);
    CHECK((run.psi_rho - exact.psi_rho).cwiseAbs().maxCoeff() < 30 * e * exact.psi_rho.cwiseAbs().maxCoeff() + 1e-7);
  }
}

TEST_CASE("rounded numbers are said, and with them what tolerance would take them", "[rounded_loops]") {
  const auto words = [](const Scene& scene) {
    const Mechanism mechanism(scene, nominal(scene));
    const Assembly assembly(mechanism, 0);
    return assembly.result().ok ? start_warnings(mechanism, assembly) : std::vector{assembly.result().message};
  };
  CHECK_THAT(words(rounded_four_bar(1e-7, 0)).at(0), Catch::Contains("'D'") && Catch::Contains("are rounded"));
  Scene coarse = rounded_four_bar(0, 1e-4);
  CHECK_THAT(words(coarse).at(0), Catch::Contains("set simulation.redundancy_tolerance"));
  coarse.simulation.redundancy_tolerance = 1e-4;
  CHECK(found_in(coarse).made);
  CHECK(words(coarse).size() == 1);
  coarse.simulation.redundancy_tolerance = 0;
  CHECK(found_in(coarse).joints.empty());
}

TEST_CASE("what is no rounding stays as it is", "[rounded_loops]") {
  Scene scene = four_bar();
  SECTION("an axis tilted on purpose") { scene = rounded_four_bar(0, 2e-3); }
  SECTION("all bars in line") {
    scene.parameters[1].value = 0.9, scene.parameters[2].value = 0.4;  // 0.5 + 0.9 = 1 + 0.4
    scene.bodies[0].orientation = turned("0");
    scene.bodies[1].position = vec("0.5", "0", "0"), scene.bodies[1].orientation = turned("1e-6");
    scene.bodies[2].position = vec("1", "0", "0"), scene.bodies[2].orientation = turned("1e-6");
  }
  SECTION("a coupler of a hundred thousandth of the other bars") {
    scene.parameters[0].value = 0.7, scene.parameters[1].value = 1e-5, scene.parameters[2].value = 0.7;
  }
  CHECK_FALSE(found_in(scene).made);
}

TEST_CASE("two hinges of a door are in line to within rounding, far from the origin as well", "[rounded_loops]") {
  Scene scene;
  const double far = GENERATE(0.0, 1e4);
  add_parameters(scene, {{"x", far}, {"e", GENERATE(0.0, 1e-7)}});
  scene.bodies.push_back(body("door", vec("0.4", "0", "1"), vec("x", "0", "0"), turned("0")));
  scene.joints.push_back(hinge("low", "ground", vec("x", "0", "0.3"), "door", vec("0", "0", "0.3")));
  scene.joints.push_back(hinge("high", "ground", vec("x+e", "-e", "1.8"), "door", vec("0", "0", "1.8")));
  const RoundedLoops found = found_in(scene);
  CHECK(found.made == (scene.parameters[1].value > 0));
  const Mechanism mechanism(scene, nominal(scene));
  CHECK(Assembly(mechanism, 0).degrees_of_freedom() == 1);
}

TEST_CASE("many bodies in the plane of others, or over it, are seen through at sight or closed", "[rounded_loops]") {
  // Squares of bars 1 m long side by side, whose couplers lie at a height of their own and whose last foot may not.
  Scene scene;
  const int squares = GENERATE(1, 6);
  const bool is_closed = GENERATE(true, false);  // the guess
  add_parameters(scene, {{"e", GENERATE(0.0, 1e-7)}, {"up", GENERATE(0.0, 0.3)}, {"twin", GENERATE(0.0, 1.0)}});
  const std::string lean = is_closed ? "0" : "0.1";
  const auto bar = [&](const std::string& name, const std::string& x, const std::string& y, const std::string& z) {
    scene.bodies.push_back(body(name, vec("0", "0", "0"), vec(x, y, z), turned(lean)));
  };
  for (int i = 0; i <= squares; ++i) {
    const std::string crank = "crank" + std::to_string(i), x = std::to_string(i);
    bar(crank, x, "0.5", "0");
    scene.joints.push_back(
        hinge("foot" + x, "ground", vec(x, "0", i == squares ? "e" : "0"), crank, vec("0", "-0.5", "0")));
    if (i == 0) continue;
    const std::string before = "crank" + std::to_string(i - 1), coupler = "coupler" + x;
    bar(coupler, x + "-0.5", "1", "up");
    scene.joints.push_back(hinge("left" + x, before, vec("0", "0.5", "up"), coupler, vec("-0.5", "0", "0")));
    scene.joints.push_back(hinge("right" + x, coupler, vec("0.5", "0", "0"), crank, vec("0", "0.5", "up")));
  }
  if (scene.parameters[2].value > 0) {  // a second coupler, redundant in the plane as well, and a bit too long
    bar("twin", "0.5", "0.8", "0");
    scene.joints.push_back(hinge("twin0", "crank0", vec("0", "0.3", "0"), "twin", vec("-0.5", "0", "0")));
    scene.joints.push_back(hinge("twin1", "twin", vec("0.5+e", "0", "0"), "crank1", vec("0", "0.3", "0")));
  }
  CAPTURE(squares, is_closed, nominal(scene).transpose());
  CHECK(found_in(scene).made == (scene.parameters[0].value > 0));
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  CHECK(assembly.degrees_of_freedom() == 1);
  if (scene.parameters[0].value == 0) CHECK(mechanism.data().planar);
}
