#include "core/sensor/point_sensor.hpp"

#include <algorithm>

namespace mbsopt {

namespace {

// A position in the ground's axes, which most objectives look at, needs neither velocities nor frames.
bool is_place(const PointSensor& sensor) {
  return sensor.quantity == PointSensor::Quantity::position && sensor.axes_body < 1;
}

// A body's r, e0 and e in y, in which q comes first, read where they are.
struct Placed {
  Eigen::Map<const Vector3d> r;
  double e0;
  Eigen::Map<const Vector3d> e;

  Placed(const Eigen::VectorXd& y, int body) : Placed(y.data() + 7 * (body - 1)) {}
  explicit Placed(const double* q) : r(q), e0(q[3]), e(q + 4) {}
};

// A(p) s of euler_parameters.hpp.
Vector3d place(const PointSensor::Point& point, const Eigen::VectorXd& y) {
  if (point.body == 0) return point.s;
  const Placed b(y, point.body);
  const Vector3d& s = point.s;
  return b.r + (b.e0 * b.e0 - b.e.squaredNorm()) * s + (2 * b.e.dot(s)) * b.e + (2 * b.e0) * b.e.cross(s);
}

void add_place_bar(const PointSensor::Point& point, const Eigen::VectorXd& y, const Vector3d& X_bar,
                   Eigen::Ref<Eigen::VectorXd> y_bar, Vector3d& s_bar) {
  if (point.body == 0) {
    s_bar += X_bar;
    return;
  }
  const Placed b(y, point.body);
  const Vector3d &s = point.s, e_s = b.e.cross(s);
  const double along = s.dot(X_bar), e_X = b.e.dot(X_bar);
  double* q_bar = y_bar.data() + 7 * (point.body - 1);
  Eigen::Map<Vector3d>{q_bar} += X_bar;
  q_bar[3] += 2 * (b.e0 * along + e_s.dot(X_bar));
  Eigen::Map<Vector3d>{q_bar + 4} += 2 * (b.e.dot(s) * X_bar + e_X * s - along * b.e + b.e0 * s.cross(X_bar));
  s_bar += (b.e0 * b.e0 - b.e.squaredNorm()) * X_bar + (2 * e_X) * b.e - (2 * b.e0) * b.e.cross(X_bar);
}

}  // namespace

double PointSensor::value(const Eigen::VectorXd& y) const {
  if (is_place(*this)) return pick(relative ? Vector3d(place(a, y) - place(b, y)) : place(a, y));
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
  if (is_place(*this)) {
    const Vector3d L = relative ? Vector3d(place(a, y) - place(b, y)) : place(a, y), X_bar = scale * along(L);
    add_place_bar(a, y, X_bar, y_bar, a_bar);
    if (relative) add_place_bar(b, y, -X_bar, y_bar, b_bar);
    return pick(L);
  }
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
