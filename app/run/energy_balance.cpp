#include "app/run/energy_balance.hpp"

#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt {

bool conserves_energy(const Scene& scene) {
  const std::vector<bool> none(scene.parameters.size(), false);
  return conserves_energy(Mechanism(scene, parameter_values(scene), none).data());
}

}  // namespace mbsopt
