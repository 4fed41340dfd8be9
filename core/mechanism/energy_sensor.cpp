// The energy of a mechanism and its gradient.   [J]
//   kinetic    sum of (m rdot'rdot + omega'J omega)/2
//   potential  sum of -m gravity'r, and of the potentials of forces
#include <algorithm>

#include "core/body/euler_parameters.hpp"
#include "core/body/inertia.hpp"
#include "core/body/state_layout.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

void add_kinetic_gradient(const MechanismData& d, const Eigen::VectorXd& y, SensorGradient& to) {
  const StateLayout layout{d.n};
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
    const BodyAt b = body_at(y, i);
    const Vector3d w = b.state.omega(), w_bar = body.J * w;
    to.y_bar.segment<3>(layout.v(i)) += to.scale * body.mass * b.frame.rdot;
    // w = 2 G(p) pdot = -2 G(pdot) p
    to.y_bar.segment<4>(layout.pdot(i)) += 2 * to.scale * G_transposed_times(b.state.p, w_bar);
    to.y_bar.segment<4>(layout.p(i)) -= 2 * to.scale * G_transposed_times(b.state.pdot, w_bar);
    to.add_slot<1>(body.slot_mass, Vec<1>(0.5 * b.frame.rdot.squaredNorm()));
    to.add_slot<6>(body.slot_J, inertia_gradient(0.5 * w * w.transpose()));
  }
}

void add_potential_gradient(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                            SensorGradient& to) {
  const StateLayout layout{d.n};
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
    const Vector3d r = y.segment<3>(layout.q(i));
    to.y_bar.segment<3>(layout.q(i)) -= to.scale * body.mass * d.gravity;
    to.add_slot<1>(body.slot_mass, Vec<1>(-d.gravity.dot(r)));
    to.add_slot<3>(d.slot_gravity, Vec<3>(-body.mass * r));
  }
  FieldGradient fields = to.fields();
  d.forces->for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    const BodyAt b1 = body_at(y, i), b2 = body_at(y, j);
    FrameBar bar1, bar2;
    bar1.set_zero();
    bar2.set_zero();
    f.pull_back_potential(angles, b1.frame, b2.frame, bar1, bar2, fields);
    to.add_frame(b1, i, bar1);
    to.add_frame(b2, j, bar2);
  });
}

struct EnergyFunction final : SensorFunction {
  bool kinetic = true, potential = true;

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    if (to && kinetic) add_kinetic_gradient(d, at.y, *to);
    if (to && potential) add_potential_gradient(d, at.y, at.angles, *to);
    const Energy e = energy(d, at.y, at.angles);
    return (kinetic ? e.kinetic : 0) + (potential ? e.potential : 0);
  }
};

}  // namespace

Energy energy(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  Energy e;
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
    const BodyAt b = body_at(y, i);
    const Vector3d w = b.state.omega();
    e.kinetic += 0.5 * (body.mass * b.frame.rdot.squaredNorm() + w.dot(body.J * w));
    e.potential -= body.mass * d.gravity.dot(b.frame.r);
  }
  d.forces->for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    e.potential += f.potential(angles, body_at(y, i).frame, body_at(y, j).frame);
  });
  return e;
}

bool conserves_energy(const MechanismData& d) {
  return d.applied.empty() && d.user_forces.empty() &&
         d.forces->all_of([](const auto& f) { return f.conserves_energy(); }) &&
         std::all_of(d.laws.begin(), d.laws.end(), [](auto& l) { return !l.law.programs; });
}

std::unique_ptr<SensorFunction> make_energy(Compilation&, const Sensor& s, const std::string& where) {
  if (s.component != "kinetic" && s.component != "potential" && s.component != "total") {
    throw SceneError(where + ".component: is '" + s.component + "'; allowed: kinetic, potential, total");
  }
  auto out = std::make_unique<EnergyFunction>();
  out->kinetic = s.component != "potential";
  out->potential = s.component != "kinetic";
  return out;
}

}  // namespace mbsopt
