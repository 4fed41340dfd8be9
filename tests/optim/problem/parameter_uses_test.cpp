#include "optim/problem/unused_parameters.hpp"

#include <catch2/catch.hpp>

#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("the fields that a parameter enters are named by their paths, also through definitions", "[scene]") {
  Problem problem;
  Scene& scene = problem.scene;
  add_parameters(scene, {{"a", 1.0}, {"b", 2.0}, {"c", 3.0}, {"unused", 4.0}});
  scene.definitions.push_back({"half", f("a/2")});
  Body bar = body("bar", vec("half", "0", "0"), vec("0", "b", "0"), turned("c"));
  bar.points["tip"] = vec("0", "a", "1");
  bar.inertia.xy = f("b");
  Shape rod;
  rod.from = vec("c", "0", "0"), rod.to = PointField("tip");
  bar.shapes.push_back(rod);
  scene.bodies.push_back(bar);
  scene.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "bar", PointField("tip")));
  Torque motor;
  motor.body = "bar", motor.components = {f("0"), f("0"), f("c*t")};
  scene.forces.push_back({"motor", motor});
  scene.sensors.push_back(angle_sensor("theta", "A"));
  scene.conditions = {value_of("theta", "b")};
  auto fields = [uses = parameter_uses(problem)](std::size_t i) { return uses.at(i).fields; };
  using Paths = std::vector<std::string>;
  CHECK(fields(0) == Paths{"bodies[0].com[0]", "bodies[0].points.tip[1]"});
  CHECK(fields(1) == Paths{"bodies[0].inertia.xy", "bodies[0].position[1]", "initial.conditions[0].value"});
  CHECK(fields(2) == Paths{"bodies[0].orientation.angle", "bodies[0].shape[0].from[0]", "forces[0].components[2]"});
  CHECK(fields(3).empty());
}
