// Position, velocity and acceleration of body-fixed points, distances and their rates.
//   X = P_a - P_b (b optional: the plain difference),  Xdot, Xddot,  in the axes R of a body or global (R = I)
//   position       a component of L = R'X, or |L| (a distance)
//   position_rate  its time derivative: a component of Ldot = Rdot'X + R'Xdot, or L'Ldot/|L|
//   velocity       a component of R'Xdot, or |Xdot|
//   acceleration   a component of R'Xddot, or |Xddot|, without gravity. It depends on the state and on z = (rddot,
//                  omegadot) of the bodies, which the equations of motion give.
#pragma once

#include <string>

#include "core/mechanism/compilation.hpp"
#include "core/mechanism/sensor_gradient.hpp"

namespace mbsopt {

struct BodyPoint {
  int body = 0;
  Vector3d s = Vector3d::Zero();  // from the centre of mass, body axes [m]
  int slot = -1;
};

BodyPoint sensor_point(Compilation& model, const std::string& body, const PointField& field, const std::string& where);

// Adds the gradients X_bar in the position of a body point and V_bar in its velocity.
void add_point(const Frame& body, const BodyPoint& point, const Vector3d& X_bar, const Vector3d& V_bar,
               SensorGradient& to);

// A body with the acceleration from the equations of motion.
Frame moving(const StatePoint& at, int body);

// Adds the gradient of X' times the acceleration of the point. The part in the motion goes to at.motion->bar().
void add_acceleration(const StatePoint& at, const BodyPoint& point, const Vector3d& X, SensorGradient& to);

struct PointSensor final : SensorFunction {
  enum class Quantity { position, velocity, acceleration, position_rate };
  Quantity quantity = Quantity::position;
  BodyPoint a, b;
  bool relative = false;  // whether b counts
  int component = 0;      // 0..2, or kNorm
  int axes_body = 0;      // body whose axes the components are in; the ground's are global

  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override;
  std::vector<int> bodies(const MechanismData&) const override { return {a.body, b.body, axes_body}; }
  SensorPtr rate(const MechanismData&) const override;
  std::vector<SensorPtr> components() const override;
};

}  // namespace mbsopt
