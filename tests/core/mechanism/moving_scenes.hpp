// Scenes in motion for tests of dynamics and integration: the reference cases, and one with every kind of term.
#pragma once

#include <fmt/format.h>

#include "core/force/user_force.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

namespace mbsopt::testing {

inline Body plain_body(const std::string& name, double mass, InertiaField inertia, VectorField position) {
  Body b;
  b.name = name, b.mass = mass, b.inertia = std::move(inertia), b.position = std::move(position);
  return b;
}

// A01: point mass 1 kg at (-1, 0) on a massless rod of 1 m, pinned at the origin. The inertia is zero.
inline Scene point_pendulum() {
  Scene s;
  s.gravity = {0.0, -9.81, 0.0};
  s.bodies.push_back(plain_body("bob", 1, {}, {-1.0, 0.0, 0.0}));
  s.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "bob", vec("1", "0", "0")));
  s.simulation.end_time = 10;
  return s;
}

// A02: N windows of unit rods, cranks up, moving at 1 m/s; passes its flat singular position about twice a second.
inline Scene n_four_bar(int windows) {
  Scene s;
  s.gravity = {0.0, -9.81, 0.0};
  const InertiaField vertical{1.0 / 12, 0.0, 1.0 / 12, 0.0, 0.0, 0.0}, flat{0.0, 1.0 / 12, 1.0 / 12, 0.0, 0.0, 0.0};
  for (int i = 0; i <= windows; ++i) {
    Body crank = plain_body(fmt::format("crank{}", i), 1, vertical, {static_cast<double>(i), 0.5, 0.0});
    crank.velocity = {0.5, 0.0, 0.0}, crank.angular_velocity = {0.0, 0.0, -1.0};
    s.bodies.push_back(crank);
  }
  for (int i = 1; i <= windows; ++i) {
    Body coupler = plain_body(fmt::format("coupler{}", i), 1, flat, {i - 0.5, 1.0, 0.0});
    coupler.velocity = {1.0, 0.0, 0.0};
    s.bodies.push_back(coupler);
  }
  const VectorField low = vec("0", "-0.5", "0"), top = vec("0", "0.5", "0");
  for (int i = 0; i <= windows; ++i) {
    s.joints.push_back(
        hinge(fmt::format("g{}", i), "ground", {static_cast<double>(i), 0.0, 0.0}, fmt::format("crank{}", i), low));
  }
  for (int i = 1; i <= windows; ++i) {
    const std::string coupler = fmt::format("coupler{}", i);
    s.joints.push_back(
        hinge(fmt::format("l{}", i), fmt::format("crank{}", i - 1), top, coupler, vec("-0.5", "0", "0")));
    s.joints.push_back(hinge(fmt::format("r{}", i), coupler, vec("0.5", "0", "0"), fmt::format("crank{}", i), top));
  }
  s.sensors.push_back(point_sensor("x", "position", "crank0", top, "x"));
  s.sensors.push_back(point_sensor("y", "position", "crank0", top, "y"));
  s.simulation.end_time = 10;
  return s;
}

// The closed spatial loop of small_scenes.hpp with every kind of force on it, each with parameters of its own.
inline Scene loaded_four_bar() {
  Scene s = spatial_four_bar();
  add_parameters(s, {{"k", 40.0},
                     {"c", 0.8},
                     {"l0", 0.5},
                     {"pull", 1.5},
                     {"kt", 2.0},
                     {"rest", 0.2},
                     {"q", 3.0},
                     {"m2", 1.4},
                     {"Ixy", 0.03},
                     {"g", 9.81},
                     {"drag", 0.4}});
  s.gravity = vec("0.2*g", "0", "-g");
  s.bodies[1].mass = f("m2");
  s.bodies[1].inertia.xy = f("Ixy");
  Tsda spring;
  spring.body1 = "crank", spring.point1 = vec("c1", "0.1", "0");
  spring.body2 = "rocker", spring.point2 = vec("0.2", "off", "c3");
  spring.stiffness = f("k"), spring.damping = f("c"), spring.free_length = f("l0"), spring.actuator = f("pull");
  s.forces.push_back({"spring", spring});
  Tsda cubic;
  cubic.body2 = "coupler", cubic.point1 = vec("0.3", "0.2", "px"), cubic.point2 = vec("c2", "0", "0.1");
  cubic.law = f("q*(l - 0.4)^3 + c*ldot*l + 0.1*sin(3*t)");
  s.forces.push_back({"cubic", cubic});
  Rsda torsion;
  torsion.joint = "A", torsion.stiffness = f("kt"), torsion.damping = 0.1, torsion.free_angle = f("rest");
  s.forces.push_back({"torsion", torsion});
  Rsda stop;
  stop.joint = "A", stop.law = f("0.3*angle^3 + drag*rate*cos(t)");
  s.forces.push_back({"stop", stop});
  s.sensors.push_back(angle_sensor("angle", "A"));
  s.sensors.push_back(point_sensor("z", "position", "rocker", vec("L3", "0", "0"), "z"));
  s.sensors.push_back(point_sensor("v", "velocity", "coupler", vec("c2", "0", "0"), "norm"));
  return s;
}

// The same with every type of force, those written with sensors too. The last parameter is still drag.
inline Scene every_force_four_bar() {
  Scene s = loaded_four_bar();
  const Parameter drag = s.parameters.back();
  s.parameters.pop_back();
  add_parameters(s, {{"kb", 6.0}, {"cb", 0.3}, {"mu", 0.4}, {"slip", 1.5}, {"push", 0.7}});
  s.parameters.push_back(drag);
  BushingSpec mount;
  mount.body2 = "rocker", mount.point1 = vec("dx", "0.1", "dz"), mount.point2 = vec("off", "0.1", "0");
  mount.stiffness = vec("kb", "4", "kb/2"), mount.damping = vec("cb", "0.2", "0.1");
  mount.torsional_stiffness = vec("0.5", "kb/5", "0.7"), mount.torsional_damping = vec("0.1", "cb/4", "0.05");
  s.forces.push_back({"mount", mount});
  FrictionSpec brake;
  brake.joint = "A", brake.coulomb = f("mu"), brake.smooth_velocity = f("slip"), brake.viscous = f("cb/3");
  brake.breakaway = f("1.3*mu"), brake.stribeck_velocity = f("2*slip");
  s.forces.push_back({"brake", brake});
  PointForce follower;
  follower.body = "coupler", follower.point = vec("c2", "0.1", "off"), follower.in_body_frame = true;
  follower.components = {f("push*sin(2*t)"), f("-push*vz"), f("0.1*pull_of_spring")};
  s.forces.push_back({"follower", follower});
  Torque servo;
  servo.body = "crank", servo.components = {f("0.2*push*z"), f("0"), f("-kt*(angle - rest) - 0.2*v^2")};
  s.forces.push_back({"servo", servo});
  Sensor vz = point_sensor("vz", "velocity", "rocker", vec("L3", "off", "0"), "z"), tension;
  tension.name = "pull_of_spring", tension.quantity = "force", tension.force = "spring";
  s.sensors.push_back(vz);
  s.sensors.push_back(tension);
  return s;
}

// A force written by a user: -drag |r'|^2 r' - stiffness p on one body, drag the last parameter. Q on q = (r, p).
struct CubicDrag final : UserForce {
  std::string body;
  Eigen::Index drag;
  CubicDrag(std::string on, Eigen::Index parameter) : body(std::move(on)), drag(parameter) {}
  std::vector<std::string> bodies() const override { return {body}; }
  void Q(double, VecIn q, VecIn v, VecIn rho, VecOut out) const override {
    const Eigen::Vector3d w = v.head<3>();
    out.head<3>() = -rho(drag) * w.squaredNorm() * w;
    out.tail<4>() = -1.3 * q.tail<4>().cwiseProduct(Eigen::Vector4d(0, 1, 2, 3));
  }
  void K(double, VecIn, VecIn, VecIn, MatOut out) const override {
    out.diagonal().tail<4>() = 1.3 * Eigen::Vector4d(0, 1, 2, 3);
  }
  void C(double, VecIn, VecIn v, VecIn rho, MatOut out) const override {
    const Eigen::Vector3d w = v.head<3>();
    out.topLeftCorner<3, 3>() = rho(drag) * (w.squaredNorm() * Eigen::Matrix3d::Identity() + 2 * w * w.transpose());
  }
  void Q_rho(double, VecIn, VecIn v, VecIn, MatOut out) const override {
    const Eigen::Vector3d w = v.head<3>();
    out.col(drag).head<3>() = -w.squaredNorm() * w;
  }
};

}  // namespace mbsopt::testing
