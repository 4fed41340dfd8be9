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

// Adds the gradients to those that are not null.
Energy energy(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& angles, SensorGradient* kinetic,
              SensorGradient* potential) {
  Energy e;
  const StateLayout layout{d.n};
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[at(i)];
    const Frame b = body_at(y, i);
    const Vector3d &r = b.r, &rdot = b.rdot, w = b.omega(), w_bar = body.J * w;
    e.kinetic += 0.5 * (body.mass * rdot.squaredNorm() + w.dot(w_bar));
    e.potential -= body.mass * d.gravity.dot(r);
    if (kinetic) {
      kinetic->y_bar.segment<3>(layout.v(i)) += kinetic->scale * body.mass * rdot;
      // w = 2 G(p) pdot = -2 G(pdot) p
      kinetic->y_bar.segment<4>(layout.pdot(i)) += 2 * kinetic->scale * G_transposed_times(b.p, w_bar);
      kinetic->y_bar.segment<4>(layout.p(i)) -= 2 * kinetic->scale * G_transposed_times(b.pdot, w_bar);
      kinetic->add_slot<1>(body.slot_mass, Vec<1>(0.5 * rdot.squaredNorm()));
      kinetic->add_slot<6>(body.slot_J, inertia_gradient(0.5 * w * w.transpose()));
    }
    if (potential) {
      potential->y_bar.segment<3>(layout.q(i)) -= potential->scale * body.mass * d.gravity;
      potential->add_slot<1>(body.slot_mass, Vec<1>(-d.gravity.dot(r)));
      potential->add_slot<3>(d.slot_gravity, Vec<3>(-body.mass * r));
    }
  }
  d.forces->for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    const Frame b1 = body_at(y, i), b2 = body_at(y, j);
    e.potential += f.potential(angles, b1, b2);
    if (!potential) return;
    FrameBar bar1 = FrameBar::zero(), bar2 = bar1;
    FieldGradient fields = potential->fields();
    f.pull_back_potential(angles, b1, b2, bar1, bar2, fields);
    potential->add_frame(b1, i, bar1);
    potential->add_frame(b2, j, bar2);
  });
  return e;
}

struct EnergyFunction final : SensorFunction {
  bool kinetic = true, potential = true;

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const Energy e = energy(d, at.y, at.angles, kinetic ? to : nullptr, potential ? to : nullptr);
    return (kinetic ? e.kinetic : 0) + (potential ? e.potential : 0);
  }
};

}  // namespace

Energy energy(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  return energy(d, y, angles, nullptr, nullptr);
}

bool conserves_energy(const MechanismData& d) {
  return d.applied.empty() && d.user_forces.empty() && d.limits.empty() &&
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
