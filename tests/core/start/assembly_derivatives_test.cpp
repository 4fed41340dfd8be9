// Derivatives of assembled states (core/start/assembly.hpp).
#include <catch2/catch.hpp>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "tests/core/start/assembled.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST_CASE("derivatives of the assembled state: planar mechanisms", "[assembly]") {
  SECTION("pendulum at an angle and a rate") {
    Scene scene = pendulum();
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
    check_derivatives(scene);
  }
  SECTION("pendulum at its guess alone") { check_derivatives(pendulum()); }
  SECTION("double pendulum with one angle given: curvature of the constraints matters") {
    Scene scene = double_pendulum();
    scene.conditions.push_back(value_of("theta1", "theta0"));
    check_derivatives(scene);
  }
  SECTION("four-bar from a rough guess") { check_derivatives(four_bar()); }
  SECTION("four-bar at a crank angle, redundant equations") {
    Scene scene = four_bar();
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
    check_derivatives(scene);
  }
}

// Many bodies whose guess satisfies all equations are differentiated by sparse factors; the differences are of dense
// assemblies.
TEST_CASE("derivatives of the assembled state: many bodies that start where they are placed", "[assembly]") {
  SECTION("a chain in space, its first angle and rate given") {
    Scene scene;
    add_parameters(scene, {{"l", 0.2}, {"c", 0.1}, {"rate0", 0.7}, {"w", 0.3}, {"theta0", 0.0}, {"up", 0.0}});
    for (int i = 0; i < 14; ++i) {
      const std::string name = "rod" + std::to_string(i), x = std::to_string(0.2 * i);
      scene.bodies.push_back(body(name, vec("c", "up", "0"), vec(x, "0", "0"), turned("0")));
      scene.bodies.back().angular_velocity = vec("w", "0", "w/2");
      Joint joint = hinge("hinge" + std::to_string(i), i == 0 ? "ground" : "rod" + std::to_string(i - 1),
                          i == 0 ? vec("0", "0", "0") : vec("l", "0", "0"), name, vec("0", "0", "0"));
      if (i % 2 == 1) joint.axis1 = joint.axis2 = vec("0", "1", "0");
      scene.joints.push_back(joint);
    }
    scene.sensors.push_back(angle_sensor("theta", "hinge0"));
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
    check_derivatives(scene);
  }
  SECTION("windows: loops with redundant equations") {
    Scene scene;
    add_parameters(scene, {{"c", 0.5}, {"off", 0.1}, {"w", 0.4}, {"height", 1.0}});
    const auto upright = [](int i) { return "upright" + std::to_string(i); };
    for (int i = 0; i <= 7; ++i) {
      const std::string x = std::to_string(i);
      scene.bodies.push_back(body(upright(i), vec("off", "c", "0"), vec(x, "0", "0"), turned("0")));
      scene.bodies.back().angular_velocity = vec("0", "0", "w");
      scene.joints.push_back(hinge("foot" + x, "ground", vec(x, "0", "0"), upright(i), vec("0", "0", "0")));
      if (i == 0) continue;
      const std::string beam = "beam" + x;
      scene.bodies.push_back(body(beam, vec("0.5", "off", "0"), vec(std::to_string(i - 1), "1", "0"), turned("0")));
      scene.joints.push_back(hinge("left" + x, upright(i - 1), vec("0", "height", "0"), beam, vec("0", "0", "0")));
      scene.joints.push_back(hinge("right" + x, upright(i), vec("0", "height", "0"), beam, vec("1", "0", "0")));
    }
    check_derivatives(scene);
  }
}

TEST_CASE("derivatives of the assembled state: spatial loop, every kind of field and condition", "[assembly]") {
  Scene scene = spatial_four_bar();
  SECTION("no condition") {}
  SECTION("angle and rate") {
    scene.sensors.push_back(angle_sensor("theta", "A"));
    scene.conditions.push_back({"theta", f("x0"), f("v0")});
  }
  SECTION("position of a point, global") {
    scene.sensors.push_back(point_sensor("tip", "position", "coupler", vec("c2", "off", "0.1"), "x"));
    scene.conditions.push_back({"tip", f("x0+0.4"), f("v0")});
  }
  SECTION("position of a point, in the axes of a body that moves, relative to another point") {
    Sensor s = point_sensor("tip", "position", "coupler", vec("c2", "off", "0.1"), "y");
    s.relative_to = PointOnBody{"crank", vec("0", "n", "u")};
    s.in_body_frame = true;
    scene.sensors.push_back(s);
    scene.conditions.push_back({"tip", f("x0-0.4"), f("v0")});
  }
  SECTION("distance and its rate") {
    Sensor s;
    s.name = "gap", s.quantity = "distance", s.body1 = "crank", s.body2 = "rocker";
    s.point1 = vec("n", "0", "0.2"), s.point2 = vec("0", "off", "n");
    scene.sensors.push_back(s);
    scene.conditions.push_back({"gap", f("x0+0.6"), f("v0")});
  }
  SECTION("an expression of positions and its rate") {
    scene.sensors.push_back(angle_sensor("theta", "A"));
    Sensor gap;
    gap.name = "gap", gap.quantity = "distance", gap.body1 = "crank", gap.body2 = "rocker";
    gap.point1 = vec("n", "0", "0.2"), gap.point2 = vec("0", "off", "n");
    scene.sensors.push_back(gap);
    scene.sensors.push_back(expression_sensor("blend", "theta + 0.1*theta*gap + n*gap^2"));
    scene.conditions.push_back({"blend", f("x0"), f("v0")});
  }
  SECTION("an Euler parameter and its rate") {
    Sensor s;
    s.name = "e", s.quantity = "orientation", s.body = "coupler", s.component = "e1";
    scene.sensors.push_back(s);
    scene.conditions.push_back({"e", f("spin/4"), f("v0/5")});
  }
  SECTION("velocity of a point, in the body's axes") {
    Sensor s = point_sensor("v", "velocity", "coupler", vec("c2", "off", "0.1"), "y");
    s.in_body_frame = true;
    scene.sensors.push_back(s);
    scene.conditions.push_back(value_of("v", "v0"));
  }
  SECTION("angular velocity, two components") {
    for (const char* component : {"x", "z"}) {
      Sensor s;
      s.name = std::string("w") + component, s.quantity = "angular_velocity", s.body = "coupler";
      s.component = component, s.in_body_frame = s.component == "x";
      scene.sensors.push_back(s);
      scene.conditions.push_back(value_of(s.name, s.component == "x" ? "spin" : "v0"));
    }
  }
  SECTION("speeds: norms of velocity and angular velocity, not linear in v") {
    scene.sensors.push_back(point_sensor("speed", "velocity", "crank", vec("c2", "off", "0.1"), "norm"));
    Sensor s;
    s.name = "spin_rate", s.quantity = "angular_velocity", s.body = "coupler", s.component = "norm";
    scene.sensors.push_back(s);
    scene.conditions.push_back(value_of("speed", "v0"));
    scene.conditions.push_back(value_of("spin_rate", "2*spin"));
  }
  SECTION("angular momentum, a component and its norm") {
    for (const char* component : {"x", "norm"}) {
      Sensor s;
      s.name = std::string("L") + component, s.quantity = "angular_momentum", s.component = component;
      scene.sensors.push_back(s);
      scene.conditions.push_back(value_of(s.name, s.component == "x" ? "spin" : "2*v0"));
    }
  }
  SECTION("distance rate and angle rate as velocities of their own") {
    Sensor s;
    s.name = "closing", s.quantity = "distance_rate", s.body1 = "ground", s.body2 = "coupler";
    s.point1 = vec("n", "0", "0.2"), s.point2 = vec("0", "off", "n");
    scene.sensors.push_back(s);
    scene.conditions.push_back(value_of("closing", "v0"));
  }
  check_derivatives(scene);
}

TEST_CASE("a parameter that would break a redundant loop is known to have no derivative", "[assembly]") {
  Scene scene = four_bar();
  add_parameters(scene, {{"tilt", 0.0}});
  scene.joints[3].axis1 = vec("tilt", "0", "1");  // out of the plane's normal: the loop opens
  const Mechanism mechanism(scene, nominal(scene));
  CHECK(Assembly(mechanism, 0).obstructed() == std::vector<int>{7});
  scene.parameters[7].value = 1e-3;
  const AssemblyResult opened = assemble(scene);
  INFO(opened.message);
  CHECK_FALSE(opened.ok);
}

TEST_CASE("only active parameters get derivatives", "[assembly]") {
  const Scene scene = spatial_four_bar();
  const VectorXd rho = nominal(scene);
  std::vector<bool> active(static_cast<std::size_t>(rho.size()), false);
  active[1] = active[9] = true;
  const Mechanism all(scene, rho), some(scene, rho, active);
  const MatrixXd full = Assembly(all, 0).tangent(), part = Assembly(some, 0).tangent();
  REQUIRE(part.cols() == rho.size());
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const bool wanted = active[static_cast<std::size_t>(k)];
    CHECK((part.col(k) - (wanted ? 1.0 : 0.0) * full.col(k)).lpNorm<Eigen::Infinity>() < 1e-13);
  }
}
