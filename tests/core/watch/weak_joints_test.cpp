#include "core/watch/weak_joints.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "core/simulate/simulation.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// A bar on two hinges of the ground 1 m apart: fixed, unless both axes point along the bar. They do, but for an angle.
Scene bar_on_two_hinges(const std::string& angle) {
  Scene scene;
  scene.gravity = {0, 0, -9.81};
  scene.bodies.push_back(
      body("bar", vec("0.5", "0.2", "0"), vec("0", "0", "0"), AxisAngleField{vec("1", "0", "0"), f("0")}));
  for (const std::string at : {"0", "1"}) {
    Joint j = hinge("H" + at, "ground", vec(at, "0", "0"), "bar", vec(at, "0", "0"));
    const std::string tilt = at == "0" ? angle : "0";
    j.axis1 = vec("1", tilt, "0"), j.axis2 = vec("1", tilt, "0");
    scene.joints.push_back(j);
  }
  scene.simulation.end_time = 0.1;
  scene.simulation.output_step = 0.1;
  return scene;
}

bool warned(const Scene& scene) {
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult result = simulate(mechanism, scene.simulation);
  for (const std::string& warning : simulation_warnings(scene, result.statistics)) {
    if (warning.find("simulation.formulation.alpha") != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("a loop that only a small angle between its axes locks is warned of, others are not", "[simulation]") {
  CHECK(warned(bar_on_two_hinges("1e-5")));
  CHECK(warned(bar_on_two_hinges("5e-6")));
  CHECK_FALSE(warned(bar_on_two_hinges("0")));     // one freedom
  CHECK_FALSE(warned(bar_on_two_hinges("0.05")));  // none
  Scene firm = bar_on_two_hinges("1e-5");
  firm.simulation.formulation.alpha = 1e12;
  CHECK_FALSE(warned(firm));
}

TEST_CASE("a run that crawls because alpha does not hold a loop is ended with the cause", "[simulation]") {
  CHECK(weak_joints_objection(1e-3).empty());
  CHECK_THAT(weak_joints_objection(0.5), Catch::Contains("raise simulation.formulation.alpha"));
}
