// The angular momentum of all bodies together about the origin of the ground.   [kg m^2/s]
//   L = sum of m r x rdot + A J omega                       omega = 2 G(p) pdot = -2 G(pdot) p, body axes
// Its gradient for a cotangent z of L (global axes), z_B = A'z and omega_bar = J z_B:
//   r: m rdot x z     rdot: m z x r     A: z (J omega)'     pdot: 2 G(p)'omega_bar     p: -2 G(pdot)'omega_bar
//   m: z'(r x rdot)   J: z_B omega'
#include "core/body/euler_parameters.hpp"
#include "core/body/inertia.hpp"
#include "core/mechanism/sensor_kinds.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

struct AngularMomentumSensor final : SensorFunction {
  int component = 0;  // 0..2, or kNorm

  static Vector3d momentum(const MechanismData& d, const Eigen::VectorXd& y) {
    Vector3d L = Vector3d::Zero();
    for (int i = 1; i <= d.n; ++i) {
      const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
      const BodyAt b = body_at(y, i);
      L += body.mass * b.frame.r.cross(b.frame.rdot) + b.frame.A * (body.J * b.state.omega());
    }
    return L;
  }
  double value(const MechanismData& d, const StatePoint& at) const override {
    return component_value(momentum(d, at.y), component);
  }
  double add_gradient(const MechanismData& d, const StatePoint& at, double scale, VecOut y_bar,
                      VecOut rho_bar) const override {
    const Vector3d L = momentum(d, at.y), z = component_gradient(L, component);
    for (int i = 1; i <= d.n; ++i) {
      const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
      const BodyAt b = body_at(at.y, i);
      const Frame& f = b.frame;
      const Vector3d omega = b.state.omega(), z_B = f.A.transpose() * z, omega_bar = body.J * z_B;
      FrameBar bar;
      bar.set_zero();
      bar.r = body.mass * f.rdot.cross(z);
      bar.rdot = body.mass * z.cross(f.r);
      bar.A = z * (body.J * omega).transpose();
      bar.p = -2 * G_transposed_times(b.state.pdot, omega_bar);
      bar.pdot = 2 * G_transposed_times(b.state.p, omega_bar);
      add_pull_back(b, i, bar, scale, y_bar);
      add_slot<1>(d, body.slot_mass, Vec<1>(z.dot(f.r.cross(f.rdot))), scale, rho_bar);
      add_slot<6>(d, body.slot_J, inertia_gradient(z_B * omega.transpose()), scale, rho_bar);
    }
    return component_value(L, component);
  }
  std::vector<SensorPtr> components() const override {
    std::vector<SensorPtr> all;
    for (int k = 0; k < 3 && component == kNorm; ++k)
      all.push_back(changed(*this, [&](AngularMomentumSensor& c) { c.component = k; }));
    return all;
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_angular_momentum(Compilation&, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<AngularMomentumSensor>();
  out->component = component_of(s, where);
  return out;
}

}  // namespace mbsopt
