// An inertial measurement unit at a body point P, in axes M fixed in the body. m is one of them, in the body's axes.
//   a  specific force     m'A'(Pddot - g)    [m/s^2]    at rest it reads +g upwards
//   w  angular velocity   m'omega_B          [rad/s]
#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/mechanism/point_sensors.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct MountAxis {
  Vector3d m = Vector3d::UnitX();
  int slot = -1;
};

struct SpecificForceSensor final : SensorFunction {
  BodyPoint point;
  MountAxis axis;

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const BodyAt b = moving(at, point.body);
    const Vector3d W = b.frame.point_ddot(point.s) - d.gravity, along = b.frame.A * axis.m;
    if (!to) return along.dot(W);
    FrameBar bar;
    bar.set_zero();
    bar.A = W * axis.m.transpose();
    to->add_frame(b, point.body, bar);
    to->add_slot<3>(axis.slot, Vec<3>(b.frame.A.transpose() * W));
    to->add_slot<3>(d.slot_gravity, Vec<3>(-along));
    add_acceleration(at, point, along, *to);
    at.motion->fold_bar(at, to->y_bar, to->rho_bar);
    return along.dot(W);
  }
};

struct MountRateSensor final : SensorFunction {
  int body = 0;
  MountAxis axis;

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const BodyAt b = body_at(at.y, body);
    const Vector3d omega = b.state.omega();
    if (to) to->add_slot<3>(axis.slot, Vec<3>(omega));
    if (to && body > 0) {  // omega_B = 2 G(p) pdot = -2 G(pdot) p
      const StateLayout layout{d.n};
      to->y_bar.segment<4>(layout.pdot(body)) += 2 * to->scale * G_transposed_times(b.state.p, axis.m);
      to->y_bar.segment<4>(layout.p(body)) -= 2 * to->scale * G_transposed_times(b.state.pdot, axis.m);
    }
    return axis.m.dot(omega);
  }

  std::vector<int> bodies(const MechanismData&) const override { return {body}; }
};

}  // namespace

std::unique_ptr<SensorFunction> make_imu(Compilation& model, const Sensor& s, const std::string& where) {
  const std::size_t k = s.component.size() == 2 ? std::string_view("xyz").find(s.component[1]) : std::string::npos;
  if (k == std::string::npos || (s.component[0] != 'a' && s.component[0] != 'w'))
    throw SceneError(where + ".component: is '" + s.component + "'; allowed: ax, ay, az, wx, wy, wz");
  FieldVector3 e{model.fields.constant(0), model.fields.constant(0), model.fields.constant(0)};
  e[k] = model.fields.constant(1);
  MountAxis axis;
  axis.m = numbers(model.keep(axis.slot, rotated(orientation_of(model, s.axes, where + ".axes"), e)));
  if (s.component[0] == 'w') {
    auto out = std::make_unique<MountRateSensor>();
    out->body = model.body_index(s.body, where + ".body");
    out->axis = axis;
    return out;
  }
  auto out = std::make_unique<SpecificForceSensor>();
  out->point = sensor_point(model, s.body, s.point, where);
  out->axis = axis;
  return out;
}

}  // namespace mbsopt
