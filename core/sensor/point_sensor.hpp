// Position, velocity, distance and their rates of body-fixed points.
//   X = P_a - P_b (b optional: the plain difference),  Xdot its rate,  in the axes R of a body or global (R = I)
//   position       a component of L = R'X, or |L| (a distance)
//   position_rate  its time derivative: a component of Ldot = Rdot'X + R'Xdot, or L'Ldot/|L|
//   velocity       a component of R'Xdot, or |Xdot|
#pragma once

#include <algorithm>

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

  double value(const Eigen::VectorXd& y) const {
    const Seen x = seen(y);
    const Vector3d L = x.R.frame.A.transpose() * x.X;
    const Vector3d Ldot = x.R.frame.Adot.transpose() * x.X + x.R.frame.A.transpose() * x.V;
    switch (quantity) {
      case Quantity::position:
        return pick(L);
      case Quantity::position_rate:
        return along(L).dot(Ldot);
      case Quantity::velocity:
        return pick(x.R.frame.A.transpose() * x.V);
    }
    return 0;
  }

  // y_bar += scale d/dy; a_bar, b_bar: scale d/ds of the two points.
  double add_gradient(const Eigen::VectorXd& y, double scale, Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& a_bar,
                      Vector3d& b_bar) const {
    const Seen x = seen(y);
    const Matrix3d &R = x.R.frame.A, &Rdot = x.R.frame.Adot;
    const Vector3d L = R.transpose() * x.X;
    double result = 0;
    Vector3d X_bar = Vector3d::Zero(), V_bar = Vector3d::Zero();
    FrameBar R_bar;
    R_bar.set_zero();
    if (quantity == Quantity::velocity) {
      const Vector3d W = R.transpose() * x.V, direction = along(W);
      result = pick(W);
      V_bar = R * direction;
      R_bar.A = x.V * direction.transpose();
    } else if (quantity == Quantity::position) {
      const Vector3d direction = along(L);
      result = pick(L);
      X_bar = R * direction;
      R_bar.A = x.X * direction.transpose();
    } else {
      const Vector3d Ldot = Rdot.transpose() * x.X + R.transpose() * x.V, direction = along(L);
      result = direction.dot(Ldot);
      Vector3d L_bar = Vector3d::Zero();
      if (component == kNorm && L.norm() > 0) L_bar = (Ldot - result * direction) / L.norm();
      X_bar = Rdot * direction + R * L_bar;
      V_bar = R * direction;
      R_bar.A = x.V * direction.transpose() + x.X * L_bar.transpose();
      R_bar.Adot = x.X * direction.transpose();
    }
    if (axes_body >= 1) add_pull_back(x.R, axes_body, R_bar, scale, y_bar);
    add_point(x.A, a, X_bar, V_bar, scale, y_bar, a_bar);
    if (relative) add_point(x.B, b, -X_bar, -V_bar, scale, y_bar, b_bar);
    return result;
  }

 private:
  struct Seen {
    BodyAt A, B, R;  // of the two points and of the axes
    Vector3d X, V;
  };
  Seen seen(const Eigen::VectorXd& y) const {
    Seen x{body_at(y, a.body), body_at(y, b.body), body_at(y, std::max(axes_body, 0)), {}, {}};
    x.X = x.A.frame.point(a.s), x.V = x.A.frame.point_dot(a.s);
    if (relative) x.X -= x.B.frame.point(b.s), x.V -= x.B.frame.point_dot(b.s);
    return x;
  }
  double pick(const Vector3d& x) const { return component == kNorm ? x.norm() : x(component); }
  // The gradient of pick; zero at a zero vector, where a norm has none.
  Vector3d along(const Vector3d& x) const {
    if (component != kNorm) return Vector3d::Unit(component);
    const double l = x.norm();
    return l > 0 ? Vector3d(x / l) : Vector3d(Vector3d::Zero());
  }

  static void add_point(const BodyAt& body, const Point& point, const Vector3d& X_bar, const Vector3d& V_bar,
                        double scale, Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& s_bar) {
    FrameBar bar;
    bar.set_zero();
    bar.r = X_bar, bar.rdot = V_bar;
    bar.A = X_bar * point.s.transpose(), bar.Adot = V_bar * point.s.transpose();
    add_pull_back(body, point.body, bar, scale, y_bar);
    s_bar += scale * (body.frame.A.transpose() * X_bar + body.frame.Adot.transpose() * V_bar);
  }
};

}  // namespace mbsopt
