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

  double value(const MechanismData& d, const StatePoint& at) const override {
    const BodyAt b = moving(at, point.body);
    return (b.frame.A * axis.m).dot(b.frame.point_ddot(point.s) - d.gravity);
  }

  double add_gradient(const MechanismData& d, const StatePoint& at, double scale, VecOut y_bar,
                      VecOut rho_bar) const override {
    const BodyAt b = moving(at, point.body);
    const Vector3d W = b.frame.point_ddot(point.s) - d.gravity, along = b.frame.A * axis.m;
    FrameBar bar;
    bar.set_zero();
    bar.A = W * axis.m.transpose();
    add_pull_back(b, point.body, bar, scale, y_bar);
    add_slot<3>(d, axis.slot, Vec<3>(b.frame.A.transpose() * W), scale, rho_bar);
    add_slot<3>(d, d.slot_gravity, Vec<3>(-along), scale, rho_bar);
    add_acceleration(d, at, point, along, scale, y_bar, rho_bar);
    at.motion->fold_bar(at, y_bar, rho_bar);
    return along.dot(W);
  }
};

struct MountRateSensor final : SensorFunction {
  int body = 0;
  MountAxis axis;

  double value(const MechanismData&, const StatePoint& at) const override {
    return axis.m.dot(body_at(at.y, body).state.omega());
  }

  double add_gradient(const MechanismData& d, const StatePoint& at, double scale, VecOut y_bar,
                      VecOut rho_bar) const override {
    const BodyAt b = body_at(at.y, body);
    const Vector3d omega = b.state.omega();
    add_slot<3>(d, axis.slot, Vec<3>(omega), scale, rho_bar);
    if (body > 0) {  // omega_B = 2 G(p) pdot = -2 G(pdot) p
      const StateLayout layout{d.n};
      y_bar.segment<4>(layout.pdot(body)) += 2 * scale * G_transposed_times(b.state.p, axis.m);
      y_bar.segment<4>(layout.p(body)) -= 2 * scale * G_transposed_times(b.state.pdot, axis.m);
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
    out->body = model.body_index(s.body, where + ".body"), out->axis = axis;
    return out;
  }
  auto out = std::make_unique<SpecificForceSensor>();
  out->point = sensor_point(model, s.body, s.point, where), out->axis = axis;
  return out;
}

}  // namespace mbsopt
