// The common centre of mass of all bodies, and their linear momentum.
//   M = sum of m_i     X = sum of m_i r_i / M   [m]     P = sum of m_i rdot_i   [kg m/s]
//   dX/dm_i = (r_i - X)/M              dP/dm_i = rdot_i
#include "core/body/state_layout.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct MassFunction final : SensorFunction {
  int component = 0;          // 0..2, or kNorm
  bool of_velocities = true;  // m_i rdot_i, else m_i r_i
  bool mean = false;          // divided by M

  // The sum of m_i x_i, or the mean.
  Vector3d sum(const MechanismData& d, const Eigen::VectorXd& y) const {
    Vector3d X = Vector3d::Zero();
    for (int i = 1; i <= d.n; ++i) X += mass(d, i) * y.segment<3>(index(d, i));
    return mean ? Vector3d(X / total_mass(d)) : X;
  }
  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const Vector3d X = sum(d, at.y), origin = mean ? X : Vector3d(Vector3d::Zero());
    const Vector3d X_bar = component_gradient(X, component) / (mean ? total_mass(d) : 1);
    for (int i = 1; i <= d.n && to; ++i) {
      to->y_bar.segment<3>(index(d, i)) += to->scale * mass(d, i) * X_bar;
      const Vector3d x = at.y.segment<3>(index(d, i));
      to->add_slot<1>(d.bodies[static_cast<std::size_t>(i)].slot_mass, Vec<1>(X_bar.dot(x - origin)));
    }
    return component_value(X, component);
  }
  SensorPtr rate(const MechanismData&) const override {
    if (of_velocities || component == kNorm) return nullptr;
    return changed(*this, [](MassFunction& r) { r.of_velocities = true; });
  }
  std::vector<SensorPtr> components() const override {
    return of_velocities ? components_of_norm(*this) : std::vector<SensorPtr>();
  }

  static double mass(const MechanismData& d, int i) { return d.bodies[static_cast<std::size_t>(i)].mass; }
  static double total_mass(const MechanismData& d) {
    double M = 0;
    for (int i = 1; i <= d.n; ++i) M += mass(d, i);
    return M;
  }
  Eigen::Index index(const MechanismData& d, int i) const {
    const StateLayout layout{d.n};
    return of_velocities ? layout.v(i) : layout.q(i);
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_mass_sum(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<MassFunction>();
  out->component = component_of(s, where);
  out->mean = s.quantity == "centre_of_mass";
  out->of_velocities = !out->mean;
  if (out->mean && MassFunction::total_mass(model.data) <= 0) throw SceneError(where + ": no body has a mass");
  return out;
}

}  // namespace mbsopt
