// Scenes for tests, small enough to know their geometry by heart. Every number that a test wants to vary is a
// parameter.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt::testing {

inline Field f(const std::string& text) { return Expression::parse(text); }
inline VectorField vec(const std::string& x, const std::string& y, const std::string& z) { return {f(x), f(y), f(z)}; }

inline void add_parameters(Scene& scene, const std::vector<std::pair<std::string, double>>& values) {
  for (const auto& [name, value] : values) {
    Parameter p;
    p.name = name, p.value = value;
    scene.parameters.push_back(p);
  }
}

inline Eigen::VectorXd nominal(const Scene& scene) {
  Eigen::VectorXd rho(static_cast<Eigen::Index>(scene.parameters.size()));
  for (std::size_t k = 0; k < scene.parameters.size(); ++k)
    rho(static_cast<Eigen::Index>(k)) = scene.parameters[k].value;
  return rho;
}

inline Body body(const std::string& name, VectorField com, VectorField position, OrientationField orientation) {
  Body b;
  b.name = name, b.mass = 1.0, b.com = std::move(com);
  b.inertia = {0.2, 0.3, 0.4, 0.01, 0.02, 0.03};
  b.position = std::move(position), b.orientation = std::move(orientation);
  return b;
}

// Turned by an angle about z.
inline OrientationField turned(const std::string& angle) { return AxisAngleField{vec("0", "0", "1"), f(angle)}; }

// A revolute about z of both bodies.
inline Joint hinge(const std::string& name, const std::string& body1, PointField point1, const std::string& body2,
                   PointField point2) {
  Joint j;
  j.name = name, j.type = "revolute", j.body1 = body1, j.body2 = body2;
  j.point1 = std::move(point1), j.point2 = std::move(point2);
  j.axis1 = vec("0", "0", "1"), j.axis2 = vec("0", "0", "1");
  return j;
}
inline Joint hinge(const std::string& name, const std::string& body1, VectorField point1, const std::string& body2,
                   VectorField point2) {
  return hinge(name, body1, PointField(std::move(point1)), body2, PointField(std::move(point2)));
}

inline Joint ball(const std::string& name, const std::string& body1, VectorField point1, const std::string& body2,
                  VectorField point2) {
  Joint j;
  j.name = name, j.type = "spherical", j.body1 = body1, j.body2 = body2;
  j.point1 = std::move(point1), j.point2 = std::move(point2);
  return j;
}

inline Sensor angle_sensor(const std::string& name, const std::string& joint) {
  Sensor s;
  s.name = name, s.quantity = "angle", s.joint = joint;
  return s;
}
inline Sensor expression_sensor(const std::string& name, const std::string& value) {
  Sensor s;
  s.name = name, s.quantity = "expression", s.value = f(value);
  return s;
}
inline Sensor point_sensor(const std::string& name, const std::string& quantity, const std::string& on,
                           PointField point, const std::string& component) {
  Sensor s;
  s.name = name, s.quantity = quantity, s.body = on, s.point = std::move(point), s.component = component;
  return s;
}
inline Sensor point_sensor(const std::string& name, const std::string& quantity, const std::string& on,
                           VectorField point, const std::string& component) {
  return point_sensor(name, quantity, on, PointField(std::move(point)), component);
}

inline Condition value_of(const std::string& sensor, const std::string& value) { return {sensor, f(value), {}}; }
inline Condition rate_of(const std::string& sensor, const std::string& rate) { return {sensor, {}, f(rate)}; }

// One bar hinged to the ground at the origin, its centre of mass at (c, 0, 0), along x at angle 0; guess: angle a.
inline Scene pendulum() {
  Scene s;
  add_parameters(s, {{"c", 0.7}, {"a", 0.1}, {"theta0", 0.4}, {"rate0", -1.5}});
  s.bodies.push_back(body("bar", vec("c", "0", "0"), vec("0", "0", "0"), turned("a")));
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "bar", vec("0", "0", "0")));
  s.sensors.push_back(angle_sensor("theta", "A"));
  return s;
}

// Two bars in the plane x-y, the first from the ground; guess: angles a1, a2 from the x axis, the second at its place.
inline Scene double_pendulum() {
  Scene s;
  add_parameters(s, {{"L1", 1.0}, {"c1", 0.4}, {"c2", 0.6}, {"a1", 0.3}, {"a2", -0.5}, {"theta0", 0.9}, {"w1", 0.8}});
  s.bodies.push_back(body("upper", vec("c1", "0", "0"), vec("0", "0", "0"), turned("a1")));
  s.bodies.push_back(body("lower", vec("c2", "0", "0"), vec("cos(a1)", "sin(a1)", "0"), turned("a2")));
  s.bodies[0].angular_velocity = vec("0", "0", "w1");
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "upper", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "upper", vec("L1", "0", "0"), "lower", vec("0", "0", "0")));
  s.sensors.push_back(angle_sensor("theta1", "A"));
  s.sensors.push_back(angle_sensor("theta2", "B"));
  return s;
}

// Crank (from the origin), coupler, rocker (pinned at (d, 0)), lengths L1, L2, L3; each bar's frame at its first hinge
// along x. Guess: the crank at angle a1, the others loosely placed with their hinges up to a few tenths apart.
inline Scene four_bar() {
  Scene s;
  add_parameters(s, {{"L1", 0.5}, {"L2", 1.2}, {"L3", 0.9}, {"d", 1.0}, {"a1", 1.0}, {"theta0", 1.3}, {"rate0", 2.0}});
  s.bodies.push_back(body("crank", vec("L1/2", "0", "0"), vec("0", "0", "0"), turned("a1")));
  s.bodies.push_back(body("coupler", vec("L2/2", "0", "0"), vec("0.3", "0.6", "0"), turned("0.2")));
  s.bodies.push_back(body("rocker", vec("L3/2", "0", "0"), vec("1.1", "0.1", "0"), turned("1.2")));
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "crank", vec("L1", "0", "0"), "coupler", vec("0", "0", "0")));
  s.joints.push_back(hinge("C", "coupler", vec("L2", "0", "0"), "rocker", vec("L3", "0", "0")));
  s.joints.push_back(hinge("D", "ground", vec("d", "0", "0"), "rocker", vec("0", "0", "0")));
  s.sensors.push_back(angle_sensor("theta", "A"));
  return s;
}

// Spatial closed loop: crank on a tilted axis, coupler on two balls, rocker on a skew axis (RSSR), roughly placed and
// moving. Every geometric field depends on a parameter of its own.
inline Scene spatial_four_bar() {
  Scene s;
  add_parameters(s, {{"L1", 0.4}, {"L2", 1.3},  {"L3", 0.8},   {"dx", 1.0},  {"dz", 0.2},  {"u", 0.15}, {"w", -0.3},
                     {"c1", 0.2}, {"c2", 0.55}, {"c3", 0.35},  {"off", 0.1}, {"a1", 0.7},  {"a3", 1.1}, {"px", 0.25},
                     {"vx", 0.3}, {"om", 0.5},  {"roll", 0.2}, {"n", 0.4},   {"x0", 0.35}, {"v0", 0.6}, {"spin", 0.7}});
  s.bodies.push_back(
      body("crank", vec("c1", "off/2", "0.01"), vec("0.02", "0", "0"), AxisAngleField{vec("u", "0.1", "1"), f("a1")}));
  s.bodies.push_back(body("coupler", vec("c2", "0.05", "off"), vec("px", "0.35", "0.05"),
                          RollPitchYawField{vec("roll", "0.1", "0.3")}));
  s.bodies.push_back(
      body("rocker", vec("c3", "0", "0.03"), vec("dx", "0", "dz"), AxisAngleField{vec("0.1", "w", "1"), f("a3")}));
  s.bodies[0].angular_velocity = vec("0.1", "om", "1");
  s.bodies[1].velocity = vec("vx", "0.2", "-0.1");
  s.bodies[1].angular_velocity = vec("om", "-om/2", "0.3");
  Joint a = hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "off", "0"));
  a.axis1 = vec("u", "0", "1"), a.axis2 = vec("0", "u", "1");
  a.normal1 = vec("1", "n", "0"), a.normal2 = vec("1", "0", "n");
  s.joints.push_back(a);
  s.joints.push_back(ball("B", "crank", vec("L1", "0", "off"), "coupler", vec("0", "0", "0")));
  s.joints.push_back(ball("C", "coupler", vec("L2", "0", "0"), "rocker", vec("L3", "0", "0")));
  Joint d = hinge("D", "ground", vec("dx", "0", "dz"), "rocker", vec("0", "0", "0"));
  d.axis1 = vec("0.1", "w", "1"), d.axis2 = vec("w", "0", "1");
  s.joints.push_back(d);
  return s;
}

}  // namespace mbsopt::testing
