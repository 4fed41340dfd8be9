#include "app/run/energy_balance.hpp"

#include <algorithm>
#include <variant>

#include "core/scene/scene_facts.hpp"

namespace mbsopt {

bool conserves_energy(const Scene& scene) {
  const SceneFacts facts(scene);
  const auto zero = [&](const Field& field) { return facts.value(field) == 0.0; };
  if (!scene.drives.empty()) return false;  // drives do work
  return std::all_of(scene.forces.begin(), scene.forces.end(), [&](const Force& force) {
    // A constant tension has no part in the potential energy, either.
    if (const auto* tsda = std::get_if<Tsda>(&force.kind))
      return !tsda->law && zero(tsda->damping) && zero(tsda->actuator);
    if (const auto* rsda = std::get_if<Rsda>(&force.kind)) return !rsda->law && zero(rsda->damping);
    if (const auto* bar = std::get_if<TorsionBar>(&force.kind)) return !bar->law && zero(bar->damping);
    if (const auto* bushing = std::get_if<BushingSpec>(&force.kind))
      return std::all_of(bushing->damping.begin(), bushing->damping.end(), zero) &&
             std::all_of(bushing->torsional_damping.begin(), bushing->torsional_damping.end(), zero);
    return false;
  });
}

}  // namespace mbsopt
