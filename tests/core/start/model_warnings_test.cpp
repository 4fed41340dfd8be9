#include "core/start/model_warnings.hpp"

#include <catch2/catch.hpp>

#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

std::vector<std::string> warnings_of(const Scene& scene) {
  const Mechanism mechanism(scene, nominal(scene));
  return model_warnings(mechanism, Assembly(mechanism, 0));
}

}  // namespace

TEST_CASE("gravity that moves nothing in the plane of a mechanism is warned of", "[warnings]") {
  Scene scene = pendulum();  // about z
  scene.gravity = {0.0, 0.0, -9.81};
  const std::vector<std::string> found = warnings_of(scene);
  REQUIRE(found.size() == 1);
  CHECK(found[0].find("gravity: is [0, 0, -9.81] m/s^2, normal to the plane") == 0);
  scene.gravity = {0.0, -9.81, 0.0};
  CHECK(warnings_of(scene).empty());
  scene.gravity = {0.0, -0.1, -9.81};
  CHECK(warnings_of(scene).empty());
  scene.gravity = {0.0, 0.0, -9.81};
  Scene wheel = scene;  // held at its centre of mass, which no gravity moves
  wheel.bodies[0].com = {0.0, 0.0, 0.0}, wheel.joints[0].point2 = PointField(std::string("O"));
  CHECK(warnings_of(wheel).empty());
  scene.gravity = {0.0, 0.0, 0.0};
  CHECK(warnings_of(scene).empty());
}

TEST_CASE("a mechanism so far from the origin that rounding spoils its lengths is warned of", "[warnings]") {
  const auto at = [](double far, double size) {
    const std::string x = std::to_string(far), arm = std::to_string(1e6 * size) + "e-6";
    Scene scene;
    scene.gravity = {0.0, -9.81, 0.0};
    scene.bodies.push_back(body("bar", vec(arm, "0", "0"), vec(x, "0", "0"), turned("0")));
    scene.joints.push_back(hinge("A", "ground", vec(x + " - " + arm, "0", "0"), "bar", vec("-" + arm, "0", "0")));
    return warnings_of(scene);
  };
  CHECK(at(3000, 1).empty());
  CHECK(at(0.5, 1e-6).empty());
  const std::vector<std::string> found = at(3000, 1e-6);  // eps 3000 / 2e-6 = 3e-7, arms from the centre of mass
  REQUIRE(found.size() == 1);
  INFO(found[0]);
  CHECK(found[0].find("rounding of coordinates is 3e-07 of these lengths") != std::string::npos);
}

// Three spatial hinges of a planar loop share what holds the bars in their plane in ways that J'lambda leaves open. In
// the plane there is but one way.
TEST_CASE("a reaction that redundant equations leave undetermined is warned of, and no other", "[warnings]") {
  const auto of = [](const std::string& kind, const std::string& component, double height = 0, double product = 0) {
    Scene scene = four_bar();
    scene.gravity = {0.0, -9.81, 0.0};
    for (Body& b : scene.bodies) b.position[2] = 0.0, b.inertia.xz = 0.0, b.inertia.yz = 0.0;
    scene.bodies[1].com[2] = height, scene.bodies[1].inertia.xz = product;
    Sensor s;
    s.name = "reaction", s.quantity = "reaction", s.joint = "B", s.kind = kind, s.component = component;
    scene.sensors.push_back(s);
    std::vector<std::string> found;
    for (const std::string& warning : warnings_of(scene))
      if (warning.find("not determined") != std::string::npos) found.push_back(warning);
    return found;
  };
  CHECK(of("force", "x").empty());
  CHECK(of("force", "y").empty());
  CHECK(of("torque", "z").empty());
  const std::vector<std::string> found = of("force", "z");
  REQUIRE(found.size() == 1);
  CHECK(found[0].find("the reaction force in joint 'B' is not determined") == 0);
  CHECK(of("force", "norm").empty());  // of the forces in the plane
  CHECK(of("torque", "norm").empty());
  CHECK(of("force", "norm", 0.1).size() == 1);  // a centre of mass out of the plane of the points
  CHECK(of("torque", "norm", 0, 0.01).size() == 1);
  CHECK(of("torque", "x").size() == 1);
}

TEST_CASE("an angle about an axis in the plane of a mechanism is warned of", "[warnings]") {
  const auto about = [](const VectorField& axis) {
    Scene scene = pendulum();  // about z
    scene.gravity = {0.0, -9.81, 0.0};
    Sensor turn;
    turn.name = "turn", turn.quantity = "body_angle", turn.body = scene.bodies[0].name, turn.axis = PointField(axis);
    scene.sensors = {turn};
    return warnings_of(scene);
  };
  CHECK(about({0.0, 0.0, -2.0}).empty());
  const std::vector<std::string> found = about({0.0, 1.0, 0.0});
  REQUIRE(found.size() == 1);
  CHECK(found[0].find(
            "sensors.turn: its axis is not the normal of the plane in which the mechanism moves, [0, 0, 1]") == 0);
}
