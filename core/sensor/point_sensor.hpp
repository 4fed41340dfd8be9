// Position, velocity, distance and distance rate of body-fixed points.
//   X = P_a - P_b (b optional: the plain difference),  Xdot its rate
//   position, velocity:  a component of X, Xdot (or of R'X in the axes R of a body), or the norm
//   distance = |X|,  distance_rate = X'Xdot/|X|
#pragma once

#include "core/sensor/body_at.hpp"

namespace mbsopt {

struct PointSensor {
  enum class Quantity { position, velocity, distance_rate };
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
    const BodyAt A = body_at(y, a.body), B = body_at(y, b.body);
    const Vector3d X = position(A, B), V = velocity(A, B);
    switch (quantity) {
      case Quantity::position:
        return pick(in_axes(X, y));
      case Quantity::velocity:
        return pick(in_axes(V, y));
      case Quantity::distance_rate:
        return X.norm() > 0 ? X.dot(V) / X.norm() : 0.0;
    }
    return 0;
  }

  // y_bar += scale d/dy; a_bar, b_bar: scale d/ds of the two points.
  double add_gradient(const Eigen::VectorXd& y, double scale, Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& a_bar,
                      Vector3d& b_bar) const {
    const BodyAt A = body_at(y, a.body), B = body_at(y, b.body);
    const Vector3d X = position(A, B), V = velocity(A, B);
    Vector3d X_bar = Vector3d::Zero(), V_bar = Vector3d::Zero();
    double result = 0;
    if (quantity == Quantity::distance_rate) {
      const double l = X.norm();
      if (l > 0) {
        const Vector3d u = X / l;
        result = u.dot(V);
        X_bar = (V - result * u) / l;
        V_bar = u;
      }
    } else {
      const Vector3d& W = quantity == Quantity::position ? X : V;
      Vector3d direction;
      const Vector3d local = in_axes(W, y);
      result = pick(local);
      if (component == kNorm) {
        direction = result > 0 ? Vector3d(local / result) : Vector3d(Vector3d::Zero());
      } else {
        direction = Vector3d::Unit(component);
      }
      if (axes_body >= 1) {  // local = R'W: R_bar = W direction'
        const BodyAt R = body_at(y, axes_body);
        FrameBar bar;
        bar.set_zero();
        bar.A = W * direction.transpose();
        add_pull_back(R, axes_body, bar, scale, y_bar);
        direction = R.frame.A * direction;
      }
      (quantity == Quantity::position ? X_bar : V_bar) = direction;
    }
    add_point(A, a, X_bar, V_bar, scale, y_bar, a_bar);
    if (relative) add_point(B, b, -X_bar, -V_bar, scale, y_bar, b_bar);
    return result;
  }

 private:
  Vector3d position(const BodyAt& A, const BodyAt& B) const {
    return relative ? Vector3d(A.frame.point(a.s) - B.frame.point(b.s)) : A.frame.point(a.s);
  }
  Vector3d velocity(const BodyAt& A, const BodyAt& B) const {
    return relative ? Vector3d(A.frame.point_dot(a.s) - B.frame.point_dot(b.s)) : A.frame.point_dot(a.s);
  }
  Vector3d in_axes(const Vector3d& x, const Eigen::VectorXd& y) const {
    return axes_body >= 1 ? Vector3d(body_at(y, axes_body).frame.A.transpose() * x) : x;
  }
  double pick(const Vector3d& x) const { return component == kNorm ? x.norm() : x(component); }

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
