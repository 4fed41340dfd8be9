// Position, velocity, distance and their rates of body-fixed points.
//   X = P_a - P_b (b optional: the plain difference),  Xdot its rate,  in the axes R of a body or global (R = I)
//   position       a component of L = R'X, or |L| (a distance)
//   position_rate  its time derivative: a component of Ldot = Rdot'X + R'Xdot, or L'Ldot/|L|
//   velocity       a component of R'Xdot, or |Xdot|
#pragma once

#include "core/sensor/body_at.hpp"

namespace mbsopt {

struct PointSensor {
  enum class Quantity { position, position_rate, velocity };
  struct Point {
    int body = 0;
    Vector3d s = Vector3d::Zero();  // from the centre of mass, body axes [m]
    int slot = -1;
  };
  static constexpr int kNorm = 3;

  Quantity quantity = Quantity::position;
  Point a, b;
  bool relative = false;  // whether b counts
  int component = 0;      // 0..2, or kNorm
  int axes_body = -1;     // body whose axes the components are in; -1: global

  double value(const Eigen::VectorXd& y) const;

  // y_bar += scale d/dy; a_bar, b_bar: scale d/ds of the two points.
  double add_gradient(const Eigen::VectorXd& y, double scale, Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& a_bar,
                      Vector3d& b_bar) const;

 private:
  struct Seen {
    BodyAt A, B, R;  // of the two points and of the axes
    Vector3d X, V;
  };
  Seen seen(const Eigen::VectorXd& y) const;
  double pick(const Vector3d& x) const { return component == kNorm ? x.norm() : x(component); }
  // The gradient of pick; zero at a zero vector, where a norm has none.
  Vector3d along(const Vector3d& x) const;

  static void add_point(const BodyAt& body, const Point& point, const Vector3d& X_bar, const Vector3d& V_bar,
                        double scale, Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& s_bar);
};

}  // namespace mbsopt
