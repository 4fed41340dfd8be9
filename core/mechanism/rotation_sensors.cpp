// Angular velocity of a body.
//   omega_B = 2 G(p) pdot,  omega_G = A omega_B = 2 (e0 edot - e0dot e + e x edot)
//
// An inertial measurement unit at a body point P, in axes M fixed in the body. m is one of them, in the body's axes.
//   a  specific force     m'A'(Pddot - g)    [m/s^2]    at rest it reads +g upwards
//   w  angular velocity   m'omega_B          [rad/s]
#include "core/body/state_layout.hpp"
#include "core/mechanism/point_sensors.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct MountAxis {
  Vector3d m = Vector3d::UnitX();
  int slot = -1;
};

struct AngularVelocitySensor final : SensorFunction {
  int body = 0;
  int component = 0;           // 0..2, or kNorm
  bool in_body_frame = false;  // components in the body's axes, else global
  bool mounted = false;        // along the axis of a mount instead
  MountAxis axis;

  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    const Frame b = body_at(at.y, body);
    const Vector4d &p = b.p, &pdot = b.pdot;
    const Vector3d e = p.tail<3>(), f = pdot.tail<3>();
    const double sign = in_body_frame ? -1 : 1;  // of e x edot
    const Vector3d w = 2 * (p(0) * f - pdot(0) * e + sign * e.cross(f));
    const Vector3d d = mounted ? axis.m : component_gradient(w, component);
    const double result = mounted ? axis.m.dot(w) : component_value(w, component);
    if (!to || body == 0) return result;
    to->add_slot<3>(axis.slot, w);
    Vector4d p_bar, pdot_bar;
    p_bar << d.dot(f), -pdot(0) * d + sign * f.cross(d);
    pdot_bar << -d.dot(e), p(0) * d + sign * d.cross(e);
    const StateLayout layout = StateLayout::of(at.y);
    to->y_bar.segment<4>(layout.p(body)) += 2 * to->scale * p_bar;
    to->y_bar.segment<4>(layout.pdot(body)) += 2 * to->scale * pdot_bar;
    return result;
  }
  std::vector<int> bodies(const MechanismData&) const override { return {body}; }
  std::vector<SensorPtr> components() const override { return components_of_norm(*this); }
};

struct SpecificForceSensor final : SensorFunction {
  BodyPoint point;
  MountAxis axis;

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const Frame b = moving(at, point.body);
    const Vector3d W = b.point_ddot(point.s) - d.gravity, along = b.A * axis.m;
    if (!to) return along.dot(W);
    FrameBar bar = FrameBar::zero();
    bar.A = W * axis.m.transpose();
    to->add_frame(b, point.body, bar);
    to->add_slot<3>(axis.slot, Vec<3>(b.A.transpose() * W));
    to->add_slot<3>(d.slot_gravity, Vec<3>(-along));
    add_acceleration(at, point, along, *to);
    return along.dot(W);
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_angular_velocity(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<AngularVelocitySensor>();
  out->body = model.body_index(s.body, where);
  out->component = component_of(s, where);
  out->in_body_frame = s.in_body_frame;
  return out;
}

std::unique_ptr<SensorFunction> make_imu(Compilation& model, const Sensor& s, const std::string& where) {
  const std::size_t k = s.component.size() == 2 ? std::string_view("xyz").find(s.component[1]) : std::string::npos;
  if (k == std::string::npos || (s.component[0] != 'a' && s.component[0] != 'w'))
    throw SceneError(where + ".component: is '" + s.component + "'; allowed: ax, ay, az, wx, wy, wz");
  MountAxis axis;
  const FieldVector3 e = model.fields.constants(Vector3d::Unit(static_cast<Eigen::Index>(k)));
  axis.m = numbers(model.keep(axis.slot, rotated(orientation_of(model, s.axes, where + ".axes"), e)));
  if (s.component[0] == 'w') {
    auto out = std::make_unique<AngularVelocitySensor>();
    out->body = model.body_index(s.body, where + ".body");
    out->in_body_frame = out->mounted = true;
    out->axis = axis;
    return out;
  }
  auto out = std::make_unique<SpecificForceSensor>();
  out->point = sensor_point(model, s.body, s.point, where);
  out->axis = axis;
  return out;
}

}  // namespace mbsopt
