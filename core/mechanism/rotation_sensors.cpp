// Angular velocity of a body, and its Euler parameters.
//   omega_B = 2 G(p) pdot,  omega_G = A omega_B = 2 (e0 edot - e0dot e + e x edot)
#include "core/body/state_layout.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct AngularVelocitySensor final : SensorFunction {
  int body = 0;
  int component = 0;           // 0..2, or kNorm
  bool in_body_frame = false;  // components in the body's axes, else global

  Vector3d omega(const Eigen::VectorXd& y) const {
    const BodyAt b = body_at(y, body);
    const Vector3d e = b.state.p.tail<3>(), f = b.state.pdot.tail<3>();
    const double sign = in_body_frame ? -1 : 1;
    return 2 * (b.state.p(0) * f - b.state.pdot(0) * e + sign * e.cross(f));
  }
  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    const Vector3d w = omega(at.y);
    const double result = component_value(w, component);
    if (!to || body == 0) return result;
    const Vector3d d = component_gradient(w, component);
    const BodyAt b = body_at(at.y, body);
    const Vector4d &p = b.state.p, &pdot = b.state.pdot;
    const Vector3d e = p.tail<3>(), f = pdot.tail<3>();
    const double sign = in_body_frame ? -1 : 1;  // of e x edot
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

// One entry of y: an Euler parameter, or its rate.
struct CoordinateFunction final : SensorFunction {
  int body = 0;
  Eigen::Index index = 0;  // in y

  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    if (to) to->y_bar(index) += to->scale;
    return at.y(index);
  }
  std::vector<int> bodies(const MechanismData&) const override { return {body}; }
  SensorPtr rate(const MechanismData& d) const override {
    return changed(*this, [&](CoordinateFunction& r) { r.index += StateLayout{d.n}.positions(); });
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

std::unique_ptr<SensorFunction> make_orientation(Compilation& model, const Sensor& s, const std::string& where) {
  const int body = model.body_index(s.body, where);
  if (body == 0 || s.component.size() != 2 || s.component[0] != 'e' || s.component[1] < '0' || s.component[1] > '3') {
    throw SceneError(where + ": orientation needs a moving body and a component e0, e1, e2 or e3");
  }
  auto out = std::make_unique<CoordinateFunction>();
  out->body = body;
  out->index = StateLayout{model.data.n}.p(body) + (s.component[1] - '0');
  return out;
}

}  // namespace mbsopt
