#include "core/sensor/point_sensor.hpp"

#include <algorithm>

namespace mbsopt {

double PointSensor::value(const Eigen::VectorXd& y) const {
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

double PointSensor::add_gradient(const Eigen::VectorXd& y, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                                 Vector3d& a_bar, Vector3d& b_bar) const {
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

PointSensor::Seen PointSensor::seen(const Eigen::VectorXd& y) const {
  Seen x{body_at(y, a.body), body_at(y, b.body), body_at(y, std::max(axes_body, 0)), {}, {}};
  x.X = x.A.frame.point(a.s), x.V = x.A.frame.point_dot(a.s);
  if (relative) x.X -= x.B.frame.point(b.s), x.V -= x.B.frame.point_dot(b.s);
  return x;
}

Vector3d PointSensor::along(const Vector3d& x) const {
  if (component != kNorm) return Vector3d::Unit(component);
  const double l = x.norm();
  return l > 0 ? Vector3d(x / l) : Vector3d(Vector3d::Zero());
}

void PointSensor::add_point(const BodyAt& body, const Point& point, const Vector3d& X_bar, const Vector3d& V_bar,
                            double scale, Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& s_bar) {
  FrameBar bar;
  bar.set_zero();
  bar.r = X_bar, bar.rdot = V_bar;
  bar.A = X_bar * point.s.transpose(), bar.Adot = V_bar * point.s.transpose();
  add_pull_back(body, point.body, bar, scale, y_bar);
  s_bar += scale * (body.frame.A.transpose() * X_bar + body.frame.Adot.transpose() * V_bar);
}

}  // namespace mbsopt
