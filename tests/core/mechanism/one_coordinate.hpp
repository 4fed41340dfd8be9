// Scenes of one mass along x, whose motion has a closed form.
#pragma once

#include "tests/core/mechanism/moving_scenes.hpp"

namespace mbsopt::testing {

// A mass of 1 kg from rest at x = a, a parameter of this name, under a force along x [N]: an expression of x. With -k x
// it moves as a cos(sqrt(k) t).
inline Scene swinging_mass(const std::vector<std::pair<std::string, double>>& parameters, const std::string& force,
                           double end_time, double rtol = 1e-10) {
  Scene s;
  add_parameters(s, parameters);
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("mass", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("a", "0", "0")));
  PointForce pull;
  pull.body = "mass", pull.components = {f(force), f("0"), f("0")};
  s.forces.push_back({"pull", pull});
  s.sensors.push_back(point_sensor("x", "position", "mass", vec("0", "0", "0"), "x"));
  s.simulation.end_time = end_time;
  IntegratorSettings& integrator = s.simulation.integrator;
  integrator.type = "dopri853", integrator.rtol = rtol, integrator.atol = rtol / 100;
  return s;
}

// A cart of 1 kg on a slide along x from rest, under a force along x [N]: an expression of t and signals.
inline Scene pushed_cart(const std::string& force, double end_time, double rtol) {
  Scene s;
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies = {body("cart", vec("0", "0", "0"), vec("0", "0", "0"), turned("0"))};
  Joint slide;
  slide.name = "slide", slide.type = "translational", slide.body1 = "ground", slide.body2 = "cart";
  slide.axis1 = vec("1", "0", "0"), slide.axis2 = vec("1", "0", "0");
  s.joints = {slide};
  PointForce push;
  push.body = "cart", push.components = {f(force), f("0"), f("0")};
  s.forces.push_back({"push", push});
  s.simulation.end_time = end_time;
  s.simulation.integrator.rtol = rtol, s.simulation.integrator.atol = rtol / 100;
  return s;
}

}  // namespace mbsopt::testing
