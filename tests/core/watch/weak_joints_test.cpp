#include "core/watch/weak_joints.hpp"

#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
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
  scene.simulation.redundancy_tolerance = 0;  // these angles are meant; by default they would count as rounding
  return scene;
}

bool warned(const Scene& scene) {
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult result = simulate(mechanism, scene.simulation);
  for (const std::string& warning : simulation_warnings(scene, scene.simulation, result.statistics)) {
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

// A ring of seven bars in the plane on hinges whose axes are tilted at random: they hold it in the plane as the tilt.
Scene tilted_ring(double tilt) {
  Scene scene;
  scene.gravity = {0.3, -9.81, 0.2};
  std::array<Vector3d, 7> corner;
  for (std::size_t k = 0; k < 7; ++k) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(k) / 7;
    corner[k] = {std::cos(turn), std::sin(turn), 0};
  }
  const auto text = [](const Vector3d& x) {
    return vec(fmt::format("{}", x(0)), fmt::format("{}", x(1)), fmt::format("{}", x(2)));
  };
  Vector3d before = Vector3d::Zero();  // origin of the body before
  for (std::size_t k = 0; k < 7; ++k) {
    const bool closing = k == 6;
    const Vector3d here = closing ? Vector3d(Vector3d::Zero()) : Vector3d((corner[k] + corner[k + 1]) / 2);
    const std::string name = closing ? "ground" : fmt::format("b{}", k);
    if (!closing) {
      scene.bodies.push_back(body(name, vec("0", "0", "0"), text(here), turned("0")));
      scene.bodies.back().mass = 1.0;
      scene.bodies.back().inertia = {0.02, 0.03, 0.04, 0.0, 0.0, 0.0};
    }
    Joint j = hinge(fmt::format("j{}", k), k == 0 ? "ground" : fmt::format("b{}", k - 1), text(corner[k] - before),
                    name, text(corner[k] - here));
    const double at = static_cast<double>(k);
    j.axis1 = j.axis2 = text({tilt * std::cos(3 * at), tilt * std::sin(5 * at), 1});
    scene.joints.push_back(j);
    before = here;
  }
  scene.simulation.end_time = 0.1;
  scene.simulation.integrator.type = "dopri853", scene.simulation.integrator.rtol = 1e-8;
  return scene;
}

TEST_CASE("a ring that gives way a little between tilted axes is warned of, since gradients magnify it",
          "[simulation]") {
  CHECK(warned(tilted_ring(5e-4)));
  CHECK_FALSE(warned(tilted_ring(1e-3)));
}

TEST_CASE("a run that crawls because alpha does not hold a loop is ended with the cause", "[simulation]") {
  CHECK(weak_joints_objection(1e-3).empty());
  CHECK_THAT(weak_joints_objection(0.5), Catch::Contains("raise simulation.formulation.alpha"));
}
