#include "core/mechanism/point_sensors.hpp"

#include <algorithm>
#include <cassert>

#include "core/body/state_layout.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {

BodyAt moving(const StatePoint& at, int body) {
  assert(at.motion);
  BodyAt b = body_at(at.y, body);
  if (body > 0) set_acceleration(at.motion->motion(at).z[static_cast<std::size_t>(body - 1)], b.state, b.frame);
  return b;
}

void add_acceleration(const StatePoint& at, const BodyPoint& point, const Vector3d& X, SensorGradient& to) {
  const BodyAt b = moving(at, point.body);
  to.add_slot<3>(point.slot, Vec<3>(b.frame.Addot.transpose() * X));
  if (point.body == 0) return;
  FrameBar bar;
  bar.set_zero();
  bar.Addot = to.scale * X * point.s.transpose();
  const StateLayout layout{to.data.n};
  add_pull_back(b.state, bar, Vector4d::Zero(), Vector3d::Zero(), to.y_bar.segment<7>(layout.q(point.body)),
                to.y_bar.segment<7>(layout.v(point.body)));
  // X'A (omegadot x s) = omegadot'(s x A'X)
  Vec<6>& out = at.motion->bar().z[static_cast<std::size_t>(point.body - 1)];
  out.head<3>() += to.scale * X;
  out.tail<3>() += to.scale * point.s.cross(b.frame.A.transpose() * X);
}

BodyPoint sensor_point(Compilation& model, const std::string& body, const PointField& field, const std::string& where) {
  BodyPoint result;
  result.body = model.body_index(body, where);
  result.s = numbers(model.keep(result.slot, model.point(result.body, field, where)));
  return result;
}

void add_point(const BodyAt& body, const BodyPoint& point, const Vector3d& X_bar, const Vector3d& V_bar,
               SensorGradient& to) {
  FrameBar bar;
  bar.set_zero();
  bar.r = X_bar;
  bar.rdot = V_bar;
  bar.A = X_bar * point.s.transpose();
  bar.Adot = V_bar * point.s.transpose();
  to.add_frame(body, point.body, bar);
  to.add_slot<3>(point.slot, Vec<3>(body.frame.A.transpose() * X_bar + body.frame.Adot.transpose() * V_bar));
}

namespace {

// A position in the ground's axes needs neither velocities nor frames. Most objectives read such positions.
bool is_place(const PointSensor& sensor) {
  return sensor.quantity == PointSensor::Quantity::position && sensor.axes_body < 1;
}

// Maps a body's r, e0 and e in y, where q comes first, without a copy.
struct Placed {
  Eigen::Map<const Vector3d> r;
  double e0;
  Eigen::Map<const Vector3d> e;

  Placed(const Eigen::VectorXd& y, int body) : Placed(y.data() + StateLayout::of(y).q(body)) {}
  explicit Placed(const double* q) : r(q), e0(q[3]), e(q + 4) {}
};

// A(p) s of euler_parameters.hpp.
Vector3d place(const BodyPoint& point, const Eigen::VectorXd& y) {
  if (point.body == 0) return point.s;
  const Placed b(y, point.body);
  const Vector3d& s = point.s;
  return b.r + (b.e0 * b.e0 - b.e.squaredNorm()) * s + (2 * b.e.dot(s)) * b.e + (2 * b.e0) * b.e.cross(s);
}

void add_place(const BodyPoint& point, const Eigen::VectorXd& y, const Vector3d& X_bar, SensorGradient& to) {
  if (point.body == 0) return to.add_slot<3>(point.slot, X_bar);
  const Placed b(y, point.body);
  const Vector3d &s = point.s, e_s = b.e.cross(s);
  const double along = s.dot(X_bar), e_X = b.e.dot(X_bar);
  double* q_bar = to.y_bar.data() + StateLayout{to.data.n}.q(point.body);
  const double twice = 2 * to.scale;
  Eigen::Map<Vector3d>{q_bar} += to.scale * X_bar;
  q_bar[3] += twice * (b.e0 * along + e_s.dot(X_bar));
  Eigen::Map<Vector3d>{q_bar + 4} += twice * (b.e.dot(s) * X_bar + e_X * s - along * b.e + b.e0 * s.cross(X_bar));
  const Vec<3> s_bar = (b.e0 * b.e0 - b.e.squaredNorm()) * X_bar + (2 * e_X) * b.e - (2 * b.e0) * b.e.cross(X_bar);
  to.add_slot<3>(point.slot, s_bar);
}

// Kinematic acceleration (without gravity) of a body point, or the plain difference of two.   [m/s^2]
//   W = Pddot_a - Pddot_b,  Pddot = rddot + Addot s;   a component of R'W in the axes R of a body or global, or |W|
// It depends on the state and on z = (rddot, omegadot) of the bodies, which the equations of motion give.
struct AccelerationSensor final : SensorFunction, SeenPoints {
  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    Vector3d W = moving(at, a.body).frame.point_ddot(a.s);
    if (relative) W -= moving(at, b.body).frame.point_ddot(b.s);
    const BodyAt R = body_at(at.y, std::max(axes_body, 0));
    const Vector3d seen = R.frame.A.transpose() * W;
    if (!to) return component_value(seen, component);
    const Vector3d direction = component_gradient(seen, component), W_bar = R.frame.A * direction;
    FrameBar bar;
    bar.set_zero();
    bar.A = W * direction.transpose();
    if (axes_body > 0 && component != kNorm) to->add_frame(R, axes_body, bar);
    add_acceleration(at, a, W_bar, *to);
    if (relative) add_acceleration(at, b, -W_bar, *to);
    at.motion->fold_bar(at, to->y_bar, to->rho_bar);
    return component_value(seen, component);
  }
};

// Sets a point, perhaps relative to another one, and a component in some axes.
void set_points(Compilation& model, const Sensor& s, SeenPoints& of, const std::string& where) {
  of.a = sensor_point(model, s.body, s.point, where);
  if (s.relative_to) {
    of.relative = true;
    of.b = sensor_point(model, s.relative_to->body, s.relative_to->point, where + ".relative_to");
  }
  of.component = component_of(s, where);
  if (s.in_body_frame && of.a.body > 0) of.axes_body = of.a.body;
}

}  // namespace

double PointSensor::evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const {
  const Eigen::VectorXd& y = at.y;
  if (is_place(*this)) {
    const Vector3d L = relative ? Vector3d(place(a, y) - place(b, y)) : place(a, y);
    if (to) add_place(a, y, along(L), *to);
    if (to && relative) add_place(b, y, -along(L), *to);
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
  if (!to) return result;
  if (axes_body >= 1) to->add_frame(x.R, axes_body, R_bar);
  add_point(x.A, a, X_bar, V_bar, *to);
  if (relative) add_point(x.B, b, -X_bar, -V_bar, *to);
  return result;
}

PointSensor::Seen PointSensor::seen(const Eigen::VectorXd& y) const {
  Seen x{body_at(y, a.body), body_at(y, b.body), body_at(y, std::max(axes_body, 0)), {}, {}};
  x.X = x.A.frame.point(a.s);
  x.V = x.A.frame.point_dot(a.s);
  if (relative) {
    x.X -= x.B.frame.point(b.s);
    x.V -= x.B.frame.point_dot(b.s);
  }
  return x;
}

std::vector<int> PointSensor::bodies(const MechanismData&) const {
  return {a.body, relative ? b.body : 0, std::max(axes_body, 0)};
}

SensorPtr PointSensor::rate(const MechanismData&) const {
  if (quantity != PointSensor::Quantity::position) return nullptr;
  return changed(*this, [](PointSensor& r) { r.quantity = PointSensor::Quantity::position_rate; });
}

std::vector<SensorPtr> PointSensor::components() const {
  return quantity == PointSensor::Quantity::velocity ? components_of_norm(*this) : std::vector<SensorPtr>();
}

std::unique_ptr<SensorFunction> make_place(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<PointSensor>();
  if (s.quantity == "velocity") out->quantity = PointSensor::Quantity::velocity;
  set_points(model, s, *out, where);
  return out;
}

std::unique_ptr<SensorFunction> make_distance(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<PointSensor>();
  if (s.quantity == "distance_rate") out->quantity = PointSensor::Quantity::position_rate;
  out->component = SensorFunction::kNorm;
  out->relative = true;
  out->a = sensor_point(model, s.body2, s.point2, where);
  out->b = sensor_point(model, s.body1.empty() ? "ground" : s.body1, s.point1, where);
  return out;
}

std::unique_ptr<SensorFunction> make_acceleration(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<AccelerationSensor>();
  set_points(model, s, *out, where);
  return out;
}

}  // namespace mbsopt
