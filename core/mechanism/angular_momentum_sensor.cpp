// The angular momentum of all bodies together about the origin of the ground.   [kg m^2/s]
//   L = sum of m r x rdot + A J omega                       omega = 2 G(p) pdot = -2 G(pdot) p, body axes
// Its gradient for a cotangent z of L (global axes), z_B = A'z and omega_bar = J z_B:
//   r: m rdot x z     rdot: m z x r     A: z (J omega)'     pdot: 2 G(p)'omega_bar     p: -2 G(pdot)'omega_bar
//   m: z'(r x rdot)   J: z_B omega'
#include "core/body/euler_parameters.hpp"
#include "core/body/inertia.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct AngularMomentumSensor final : SensorFunction {
  int component = 0;  // 0..2, or kNorm

  static Vector3d momentum(const MechanismData& d, const Eigen::VectorXd& y) {
    Vector3d L = Vector3d::Zero();
    for (int i = 1; i <= d.n; ++i) {
      const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
      const Frame b = body_at(y, i);
      L += body.mass * b.r.cross(b.rdot) + b.A * (body.J * b.omega());
    }
    return L;
  }
  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const Vector3d L = momentum(d, at.y), z = component_gradient(L, component);
    for (int i = 1; i <= d.n && to; ++i) {
      const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
      const Frame f = body_at(at.y, i);
      const Vector3d omega = f.omega(), z_B = f.A.transpose() * z, omega_bar = body.J * z_B;
      FrameBar bar = FrameBar::zero();
      bar.r = body.mass * f.rdot.cross(z);
      bar.rdot = body.mass * z.cross(f.r);
      bar.A = z * (body.J * omega).transpose();
      bar.p = -2 * G_transposed_times(f.pdot, omega_bar);
      bar.pdot = 2 * G_transposed_times(f.p, omega_bar);
      to->add_frame(f, i, bar);
      to->add_slot<1>(body.slot_mass, Vec<1>(z.dot(f.r.cross(f.rdot))));
      to->add_slot<6>(body.slot_J, inertia_gradient(z_B * omega.transpose()));
    }
    return component_value(L, component);
  }
  std::vector<SensorPtr> components() const override { return components_of_norm(*this); }
};

}  // namespace

std::unique_ptr<SensorFunction> make_angular_momentum(Compilation&, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<AngularMomentumSensor>();
  out->component = component_of(s, where);
  return out;
}

}  // namespace mbsopt
