// FB-1: the five-bar with two springs, and its independent reference values.
// Bars A-1, 1-2, 2-3, 3-B are uniform rods in the x-y plane, springs A-2 and B-2, gravity along -y, at rest, 5 s.
//   psi = integral of |r2 - r2(0)|^2 dt
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "optim/problem/problem.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

namespace five_bar {

inline constexpr double kPsi = 0.12883112793824;
// Complex step through an 8th-order method with exact constraints; h = 4e-3 and 2e-3 agree to 1e-14.
inline const std::array<std::pair<const char*, double>, 10> kGradient{{{"L01", 0.43585125087835},
                                                                       {"L02", 1.61976207776287},
                                                                       {"k1", -0.00068529458007929},
                                                                       {"k2", -0.00231809881744949},
                                                                       {"c1", -0.040992678495154},
                                                                       {"c2", -0.038258434911866},
                                                                       {"m1", -0.010025945272298},
                                                                       {"m2", 0.059162921408138},
                                                                       {"m3", 0.116610652344094},
                                                                       {"m4", 0.046704924396818}}};
inline constexpr double kL01 = 2.1469536808839935, kL02 = 1.9183006617287768;  // the optimum, psi = 0

// A uniform rod from (x1, y1) to (x2, y2), its frame in the middle, x along the rod; its mass is a parameter.
inline mbsopt::Body rod(const std::string& name, const std::string& mass, double x1, double y1, double x2, double y2) {
  const double length = std::hypot(x2 - x1, y2 - y1);
  mbsopt::Body b;
  b.name = name, b.mass = mbsopt::Expression::parse(mass);
  // m l^2/12; the coordinates are short decimals, so that their text is exact
  const auto text = [](double x) { return "(" + std::to_string(x) + ")"; };
  const mbsopt::Field inertia = mbsopt::Expression::parse(mass + "/12*((" + text(x2) + "-" + text(x1) + ")^2+(" +
                                                          text(y2) + "-" + text(y1) + ")^2)");
  b.inertia = {0.0, inertia, inertia, 0.0, 0.0, 0.0};
  b.position = {(x1 + x2) / 2, (y1 + y2) / 2, 0.0};
  b.orientation = mbsopt::AxisAngleField{{0.0, 0.0, 1.0}, std::atan2(y2 - y1, x2 - x1)};
  b.points["from"] = {-length / 2, 0.0, 0.0};
  b.points["to"] = {length / 2, 0.0, 0.0};
  return b;
}

inline mbsopt::Force spring(const std::string& name, const mbsopt::VectorField& ground, const std::string& number) {
  mbsopt::Tsda s;
  s.body1 = "ground", s.point1 = ground, s.body2 = "bar2", s.point2 = "to";
  s.stiffness = mbsopt::Expression::parse("k" + number), s.damping = mbsopt::Expression::parse("c" + number);
  s.free_length = mbsopt::Expression::parse("L0" + number);
  return {name, s};
}

inline mbsopt::Problem problem(double rtol = 1e-10) {
  using namespace mbsopt::testing;
  mbsopt::Problem p;
  mbsopt::Scene& s = p.scene;
  s.name = "five-bar";
  s.gravity = {0.0, -9.81, 0.0};
  add_parameters(s, {{"L01", std::sqrt(5)},
                     {"L02", std::sqrt(4.25)},
                     {"k1", 100},
                     {"k2", 100},
                     {"c1", 0},
                     {"c2", 0},
                     {"m1", 1},
                     {"m2", 1.5},
                     {"m3", 1.5},
                     {"m4", 1}});
  s.bodies = {rod("bar1", "m1", -1, 0, -1.5, -1), rod("bar2", "m2", -1.5, -1, 0, -2), rod("bar3", "m3", 0, -2, 1, -1),
              rod("bar4", "m4", 1, -1, 0.5, 0)};
  s.joints = {hinge("A", "ground", mbsopt::VectorField{-1.0, 0.0, 0.0}, "bar1", "from"),
              hinge("P1", "bar1", "to", "bar2", "from"), hinge("P2", "bar2", "to", "bar3", "from"),
              hinge("P3", "bar3", "to", "bar4", "from"),
              hinge("B", "bar4", "to", "ground", mbsopt::VectorField{0.5, 0.0, 0.0})};
  s.forces = {spring("spring_A", {-1.0, 0.0, 0.0}, "1"), spring("spring_B", {0.5, 0.0, 0.0}, "2")};
  for (const char* axis : {"x", "y"})
    s.sensors.push_back(point_sensor(std::string("r2_") + axis, "position", "bar2", "to", axis));
  s.simulation.end_time = 5;
  s.simulation.integrator.rtol = rtol, s.simulation.integrator.atol = rtol * 1e-2;
  mbsopt::ObjectiveSpec motion;
  motion.name = "motion";
  motion.running = mbsopt::Expression::parse("r2_x^2 + (r2_y + 2)^2");
  p.objectives = {motion};
  return p;
}

}  // namespace five_bar
