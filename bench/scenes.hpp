// Scenes of the benchmarks: a chain of n spatial rods, and the five-bar with its geometry as parameters; 20 and more
// parameters each.
#pragma once

#include <fmt/format.h>

#include <cmath>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt::bench {

inline Field field(const std::string& text) { return Expression::parse(text); }

inline void add_parameter(Scene& scene, const std::string& name, double value) {
  Parameter p;
  p.name = name, p.value = value;
  scene.parameters.push_back(p);
}

inline Eigen::VectorXd nominal(const Scene& scene) {
  Eigen::VectorXd rho(static_cast<Eigen::Index>(scene.parameters.size()));
  for (std::size_t k = 0; k < scene.parameters.size(); ++k)
    rho(static_cast<Eigen::Index>(k)) = scene.parameters[k].value;
  return rho;
}

inline Joint hinge(const std::string& name, const std::string& body1, VectorField point1, const std::string& body2,
                   VectorField point2, VectorField axis) {
  Joint j;
  j.name = name, j.type = "revolute", j.body1 = body1, j.body2 = body2;
  j.point1 = std::move(point1), j.point2 = std::move(point2), j.axis1 = axis, j.axis2 = std::move(axis);
  return j;
}

inline Sensor position(const std::string& name, const std::string& body, VectorField point,
                       const std::string& component) {
  Sensor s;
  s.name = name, s.quantity = "position", s.body = body, s.point = std::move(point), s.component = component;
  return s;
}

// Rods along x, hinges alternately about y and z, two springs to the ground; length, mass, inertia and hinge position
// of the first rods are parameters until there are `parameters` of them.
inline Scene chain(int rods, int parameters) {
  Scene s;
  int left = parameters;
  auto number = [&](const std::string& name, double value) -> Field {
    if (left-- <= 0) return value;
    add_parameter(s, name, value);
    return field(name);
  };
  std::string previous = "ground";
  Field reach = 0.0;
  for (int i = 0; i < rods; ++i) {
    Body b;
    b.name = fmt::format("rod{}", i);
    b.position = {0.2 * i, 0.0, 0.0};
    b.mass = number(fmt::format("m{}", i), 0.3);
    const Field length = number(fmt::format("l{}", i), 0.2);
    b.com = {number(fmt::format("c{}", i), 0.1), 0.0, 0.0};
    b.inertia = {2e-4, number(fmt::format("I{}", i), 1e-3), 1e-3, 0.0, 0.0, 0.0};
    s.bodies.push_back(b);
    s.joints.push_back(hinge(fmt::format("h{}", i), previous, {reach, 0.0, 0.0}, b.name, {0.0, 0.0, 0.0},
                             {0.0, static_cast<double>((i + 1) % 2), static_cast<double>(i % 2)}));
    previous = b.name;
    reach = length;
  }
  for (int k = 0; k < 2; ++k) {
    Tsda t;
    t.body2 = fmt::format("rod{}", k == 0 ? rods / 2 : rods - 1);
    t.point1 = VectorField{0.1 * rods, 0.1, 0.5}, t.point2 = VectorField{0.2, 0.0, 0.0};
    t.stiffness = 20.0, t.damping = 0.5, t.free_length = 0.4;
    s.forces.push_back({fmt::format("s{}", k), t});
  }
  s.sensors.push_back(position("z", previous, {0.2, 0.0, 0.0}, "z"));
  s.simulation.end_time = 1;
  s.simulation.integrator.rtol = 1e-7;
  return s;
}

// The five-bar with two springs (FB-1), every mass, length and spring constant and the ground points as parameters: 22.
inline Scene five_bar() {
  Scene s;
  s.gravity = {0.0, -9.81, 0.0};
  const double x[] = {-1, -1.5, 0, 1, 0.5}, y[] = {0, -1, -2, -1, 0};
  for (int i = 0; i < 4; ++i) {
    const std::string l = fmt::format("l{}", i), m = fmt::format("m{}", i), c = fmt::format("c{}", i);
    add_parameter(s, l, std::hypot(x[i + 1] - x[i], y[i + 1] - y[i]));
    add_parameter(s, m, i == 1 || i == 2 ? 1.5 : 1.0);
    add_parameter(s, c, s.parameters[static_cast<std::size_t>(3 * i)].value / 2);
    Body b;
    b.name = fmt::format("bar{}", i);
    b.mass = field(m), b.com = {field(c), 0.0, 0.0};
    b.inertia = {1e-4, field(m + "*" + l + "^2/12"), field(m + "*" + l + "^2/12"), 0.0, 0.0, 0.0};
    b.position = {x[i], y[i], 0.0};
    b.orientation = AxisAngleField{{0.0, 0.0, 1.0}, std::atan2(y[i + 1] - y[i], x[i + 1] - x[i])};
    b.points["end"] = {field(l), 0.0, 0.0};
    s.bodies.push_back(b);
  }
  for (const auto& [name, value] : {std::pair{"Ax", -1.0}, {"Ay", 0.0}, {"Bx", 0.5}, {"By", 0.0}})
    add_parameter(s, name, value);
  const VectorField axis{0.0, 0.0, 1.0}, A{field("Ax"), field("Ay"), 0.0}, B{field("Bx"), field("By"), 0.0};
  s.joints.push_back(hinge("A", "ground", A, "bar0", {0.0, 0.0, 0.0}, axis));
  for (int i = 0; i < 3; ++i) {
    s.joints.push_back(hinge(fmt::format("J{}", i), fmt::format("bar{}", i), {field(fmt::format("l{}", i)), 0.0, 0.0},
                             fmt::format("bar{}", i + 1), {0.0, 0.0, 0.0}, axis));
  }
  s.joints.push_back(hinge("B", "ground", B, "bar3", {field("l3"), 0.0, 0.0}, axis));
  int k = 0;
  for (const VectorField& from : {A, B}) {
    const std::string number = std::to_string(++k);
    add_parameter(s, "k" + number, 100);
    add_parameter(s, "d" + number, 0);
    add_parameter(s, "L0" + number, k == 1 ? std::sqrt(5.0) : std::sqrt(4.25));
    Tsda t;
    t.point1 = from, t.body2 = "bar1", t.point2 = "end";
    t.stiffness = field("k" + number), t.damping = field("d" + number), t.free_length = field("L0" + number);
    s.forces.push_back({"spring" + number, t});
  }
  s.sensors.push_back(position("z", "bar1", {field("l1"), 0.0, 0.0}, "y"));
  s.simulation.end_time = 5;
  s.simulation.integrator.rtol = 1e-8;
  return s;
}

}  // namespace mbsopt::bench
