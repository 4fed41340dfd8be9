// A body of 2 kg comes at 3 m/s along x from -h to a stop at 0 and goes back. The stop of stiffness 5000 N/m holds it
// for pi/50 s:  x(0.8) = -3 (0.8 - h/3 - pi/50),  d x/d h = 1.
#pragma once

#include "optim/problem/problem.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

namespace mbsopt::testing {

inline Problem stopped_body(const std::string& force = "-5000*max(0, x)") {
  Problem problem;
  Scene& s = problem.scene;
  add_parameters(s, {{"h", 1.0}});
  s.gravity = {0.0, 0.0, 0.0};
  Body b = body("b", vec("0", "0", "0"), vec("-h", "0", "0"), turned("0"));
  b.mass = 2.0, b.velocity = vec("3", "0", "0");
  s.bodies = {b};
  s.sensors = {point_sensor("x", "position", "b", "O", "x")};
  PointForce stop;
  stop.body = "b", stop.components = {f(force), f("0"), f("0")};
  s.forces = {{"stop", stop}};
  s.simulation.end_time = 0.8;
  s.simulation.integrator.type = "dopri853";
  s.simulation.integrator.rtol = 1e-8, s.simulation.integrator.atol = 1e-10;
  ObjectiveSpec objective;
  objective.name = "end", objective.terminal = f("x");
  problem.objectives = {objective};
  return problem;
}

}  // namespace mbsopt::testing
