#include "core/mechanism/point_sensors.hpp"

#include <algorithm>
#include <cassert>

#include "core/body/state_layout.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {

Frame moving(const StatePoint& at, int body) {
  assert(at.motion);
  Frame b = body_at(at.y, body);
  if (body > 0) set_acceleration(at.motion->motion(at, MotionPart::in_plane).z[static_cast<std::size_t>(body - 1)], b);
  return b;
}

void add_acceleration(const StatePoint& at, const BodyPoint& point, const Vector3d& X, SensorGradient& to) {
  const Frame b = moving(at, point.body);
  to.add_slot<3>(point.slot, Vec<3>(b.Addot.transpose() * X));
  if (point.body == 0) return;
  FrameBar bar = FrameBar::zero();
  bar.Addot = to.scale * X * point.s.transpose();
  const StateLayout layout{to.data.n};
  add_pull_back(b, bar, Vector4d::Zero(), Vector3d::Zero(), to.y_bar.segment<7>(layout.q(point.body)),
                to.y_bar.segment<7>(layout.v(point.body)));
  // X'A (omegadot x s) = omegadot'(s x A'X)
  Vec<6>& out = at.motion->bar(MotionPart::in_plane).z[static_cast<std::size_t>(point.body - 1)];
  out.head<3>() += to.scale * X;
  out.tail<3>() += to.scale * point.s.cross(b.A.transpose() * X);
}

BodyPoint sensor_point(Compilation& model, const std::string& body, const PointField& field, const std::string& where) {
  BodyPoint result;
  result.body = model.body_index(body, where);
  result.s = numbers(model.keep(result.slot, model.point(result.body, field, where)));
  return result;
}

void add_point(const Frame& body, const BodyPoint& point, const Vector3d& X_bar, const Vector3d& V_bar,
               SensorGradient& to) {
  FrameBar bar = FrameBar::zero();
  bar.r = X_bar;
  bar.rdot = V_bar;
  bar.A = X_bar * point.s.transpose();
  bar.Adot = V_bar * point.s.transpose();
  to.add_frame(body, point.body, bar);
  to.add_slot<3>(point.slot, Vec<3>(body.A.transpose() * X_bar + body.Adot.transpose() * V_bar));
}

namespace {

// A position in the ground's axes needs neither velocities nor frames. Most objectives read such positions.
bool is_place(const PointSensor& sensor) {
  return sensor.quantity == PointSensor::Quantity::position && sensor.axes_body == 0;
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

}  // namespace

double PointSensor::evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const {
  const Eigen::VectorXd& y = at.y;
  if (is_place(*this)) {
    const Vector3d L = relative ? Vector3d(place(a, y) - place(b, y)) : place(a, y);
    const Vector3d direction = component_gradient(L, component);
    if (to) add_place(a, y, direction, *to);
    if (to && relative) add_place(b, y, -direction, *to);
    return component_value(L, component);
  }
  const bool moves = quantity == Quantity::acceleration, is_rate = quantity == Quantity::position_rate;
  const auto placed = [&](int body) { return moves ? moving(at, body) : body_at(y, body); };
  const Frame A = placed(a.body), B = relative ? placed(b.body) : Frame(), axes = body_at(y, axes_body);
  const Matrix3d &R = axes.A, &Rdot = axes.Adot;
  Vector3d X[] = {A.point(a.s), A.point_dot(a.s), A.point_ddot(a.s)};
  if (relative) X[0] -= B.point(b.s), X[1] -= B.point_dot(b.s), X[2] -= B.point_ddot(b.s);
  const int order = is_rate ? 0 : static_cast<int>(quantity);
  const Vector3d L = R.transpose() * X[order], direction = component_gradient(L, component);
  double result = component_value(L, component);
  Vector3d X_bar[] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  FrameBar R_bar = FrameBar::zero();
  if (is_rate) {
    const Vector3d Ldot = Rdot.transpose() * X[0] + R.transpose() * X[1];
    result = direction.dot(Ldot);
    Vector3d L_bar = Vector3d::Zero();
    if (component == kNorm && L.norm() > 0) L_bar = (Ldot - result * direction) / L.norm();
    X_bar[0] = Rdot * direction + R * L_bar;
    X_bar[1] = R * direction;
    R_bar.A = X[1] * direction.transpose() + X[0] * L_bar.transpose();
    R_bar.Adot = X[0] * direction.transpose();
  } else {
    X_bar[order] = R * direction;
    R_bar.A = X[order] * direction.transpose();
  }
  if (!to) return result;
  to->add_frame(axes, axes_body, R_bar);
  const auto add = [&](const Frame& body, const BodyPoint& point, double sign) {
    if (moves) return add_acceleration(at, point, sign * X_bar[2], *to);
    add_point(body, point, sign * X_bar[0], sign * X_bar[1], *to);
  };
  add(A, a, 1);
  if (relative) add(B, b, -1);
  return result;
}

SensorPtr PointSensor::rate(const MechanismData&) const {
  if (quantity != Quantity::position) return nullptr;
  return changed(*this, [](PointSensor& r) { r.quantity = Quantity::position_rate; });
}

std::vector<SensorPtr> PointSensor::components() const {
  return quantity == Quantity::velocity ? components_of_norm(*this) : std::vector<SensorPtr>();
}

std::unique_ptr<SensorFunction> make_point(Compilation& model, const Sensor& s, const std::string& where) {
  using enum PointSensor::Quantity;
  auto out = std::make_unique<PointSensor>();
  out->quantity = s.quantity == "position" ? position : s.quantity == "velocity" ? velocity : acceleration;
  out->a = sensor_point(model, s.body, s.point, where);
  if (s.relative_to) {
    out->relative = true;
    out->b = sensor_point(model, s.relative_to->body, s.relative_to->point, where + ".relative_to");
  }
  out->component = component_of(s, where);
  if (s.in_body_frame) out->axes_body = out->a.body;
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

}  // namespace mbsopt
