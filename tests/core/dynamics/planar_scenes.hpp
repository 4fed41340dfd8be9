// A machine that its joints hold in a plane, with every kind of planar row and of force, each number that may vary a
// parameter; the plane is any coordinate plane, and the bodies' own axes are turned against it.
#pragma once

#include "tests/core/mechanism/small_scenes.hpp"

namespace mbsopt::testing {

// (a, b, c) along (t1, t2, n).
inline VectorField along(int normal, const std::string& a, const std::string& b, const std::string& c) {
  VectorField v;
  v[static_cast<std::size_t>((normal + 1) % 3)] = f(a);
  v[static_cast<std::size_t>((normal + 2) % 3)] = f(b);
  v[static_cast<std::size_t>(normal)] = f(c);
  return v;
}

// A crank, a coupler on it and a slider at its end; a disc geared to the crank; a bar on a rod; a plate that slides on
// the plane and keeps its edge at right angles to a driven wheel's spoke.
// out_of_plane: loads across the plane, products of inertia among them, which the joints react.
inline Scene planar_machine(int normal = 2, bool out_of_plane = true) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  const auto v = [&](const std::string& a, const std::string& b, const std::string& c = "0") {
    return along(normal, a, b, c);
  };
  const VectorField n = v("0", "0", "1"), down = v("0", "0", "-1");
  Scene s;
  add_parameters(s, {{"L1", 0.4},
                     {"L2", 1.1},
                     {"c1", 0.2},
                     {"c2", 0.5},
                     {"a1", 0.7},
                     {"h", 0.05},
                     {"m2", 1.4},
                     {"J2", 0.3},
                     {"g", 9.0},
                     {"k", 30.0},
                     {"px", -0.6},
                     {"rest", 0.5},
                     {"ratio", -1.6},
                     {"rod", 0.8},
                     {"q", 0.6},
                     {"spin", 2.5},
                     {"tilt", 0.1},
                     {"mu", 0.3},
                     {"edge", 0.2}});
  s.gravity = v("1", "-g", out_of_plane ? "0.4" : "0");
  const auto turned_by = [&](const std::string& angle) { return AxisAngleField{n, f(angle)}; };
  s.bodies.push_back(body("crank", v("c1", "0.03"), v("0", "0"), turned_by("a1")));
  Body coupler = body("coupler", v("c2", "0"), v("L1*cos(a1)", "L1*sin(a1)"), turned_by("-0.2"));
  coupler.mass = f("m2"), coupler.inertia.xx = coupler.inertia.yy = coupler.inertia.zz = f("J2");
  s.bodies.push_back(coupler);
  s.bodies.push_back(body("slider", v("0", "0.02"), v("1.4", "0.1"), turned_by("0.3")));
  // The disc lies on its other side: its own normal is against the plane's.
  s.bodies.push_back(body("disc", v("0.1", "0"), v("-1", "0.5"), AxisAngleField{v("1", "0", "0"), f("pi")}));
  s.bodies.push_back(body("bar", v("q", "0"), v("-0.4", "-1"), turned_by("1.1")));
  s.bodies.push_back(body("plate", v("0", "0.1"), v("2", "1"), turned_by("0")));
  s.bodies.push_back(body("wheel", v("0", "0"), v("3", "0"), turned_by("0.4")));
  for (Body& b : s.bodies) {
    if (!out_of_plane) b.inertia.xy = b.inertia.xz = b.inertia.yz = 0.0;
  }
  s.bodies[0].angular_velocity = v("0", "0", "1.2");
  s.bodies[4].angular_velocity = v("0", "0", "-0.5");
  s.bodies[5].velocity = v("0.3", "-0.2");

  const auto hinged = [&](const std::string& name, const std::string& body1, VectorField point1,
                          const std::string& body2, VectorField point2, const VectorField& axis2) {
    Joint j = hinge(name, body1, std::move(point1), body2, std::move(point2));
    j.axis1 = n, j.axis2 = axis2;
    j.normal1 = v("1", "0"), j.normal2 = v("cos(tilt)", "sin(tilt)");
    s.joints.push_back(j);
  };
  hinged("A", "ground", v("0", "0"), "crank", v("0", "0"), n);
  hinged("B", "crank", v("L1", "0"), "coupler", v("0", "0"), n);
  hinged("C", "coupler", v("L2", "0"), "slider", v("0.1", "0"), n);
  hinged("D", "ground", v("-1", "0.5"), "disc", v("0", "0"), down);
  hinged("E", "ground", v("-0.4", "-1"), "bar", v("0", "0"), n);
  hinged("W", "ground", v("3", "0"), "wheel", v("0", "0"), n);
  Joint rail;
  rail.name = "rail", rail.type = "translational", rail.body2 = "slider";
  rail.point1 = v("0", "0.1"), rail.point2 = v("0", "0");
  rail.axis1 = v("1", "tilt"), rail.axis2 = v("cos(edge)", "sin(edge)");
  s.joints.push_back(rail);
  Joint gear;
  gear.name = "gear", gear.type = "gear", gear.joint1 = "A", gear.joint2 = "D", gear.ratio = f("ratio");
  s.joints.push_back(gear);
  Joint table;
  table.name = "table", table.type = "planar", table.body2 = "plate", table.axis1 = n, table.axis2 = n;
  s.joints.push_back(table);
  Joint square;
  square.name = "square", square.type = "perpendicular", square.body1 = "wheel", square.body2 = "plate";
  square.axis1 = v("1", "tilt"), square.axis2 = v("edge", "1");
  s.joints.push_back(square);
  Joint rod;
  rod.name = "rod", rod.type = "distance", rod.body1 = "crank", rod.body2 = "bar", rod.length = f("rod");
  rod.point1 = v("-0.3", "c1"), rod.point2 = v("q/2", "0.05");
  s.joints.push_back(rod);
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "W", motor.law = f("0.3 + 0.2*sin(spin*t)");
  s.drives.push_back(motor);

  Tsda spring;
  spring.body1 = "ground", spring.point1 = v("px", "1", out_of_plane ? "0.3" : "0"), spring.body2 = "coupler";
  spring.point2 = v("c2", "0.1", out_of_plane ? "-h" : "0");
  spring.stiffness = f("k"), spring.damping = 0.8, spring.free_length = f("rest");
  s.forces.push_back({"spring", spring});
  Rsda torsion;
  torsion.joint = "B", torsion.stiffness = f("k/10"), torsion.damping = 0.2, torsion.free_angle = f("rest");
  s.forces.push_back({"torsion", torsion});
  FrictionSpec brake;
  brake.joint = "E", brake.coulomb = f("mu"), brake.smooth_velocity = 0.5, brake.viscous = 0.1;
  s.forces.push_back({"brake", brake});
  PointForce push;
  push.body = "plate", push.point = v("0.1", "edge");
  push.components[at((normal + 1) % 3)] = f("2*sin(spin*t)"),
                                    push.components[at((normal + 2) % 3)] = f("-k*0.01*reach");
  push.components[at(normal)] = f(out_of_plane ? "1" : "0");
  s.forces.push_back({"push", push});
  Torque twist;
  twist.body = "bar", twist.components[at(normal)] = f("mu*cos(spin*t)");
  s.forces.push_back({"twist", twist});
  s.sensors.push_back(point_sensor("reach", "position", "coupler", v("L2", "0"), "x"));
  s.sensors.push_back(angle_sensor("turn", "D"));
  s.simulation.end_time = 0.4;
  s.simulation.integrator.rtol = 1e-7, s.simulation.integrator.atol = 1e-9;
  return s;
}

}  // namespace mbsopt::testing
