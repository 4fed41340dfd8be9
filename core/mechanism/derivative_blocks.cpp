#include "core/mechanism/derivative_blocks.hpp"

#include <algorithm>

#include "core/force/forces.hpp"

namespace mbsopt {

bool depends_on_state(const AppliedForce& force) {
  if (!force.sensors.empty()) return true;
  return force.is_torque ? !force.in_body_axes : force.in_body_axes || !force.s.isZero(0);
}

long derivative_blocks(const MechanismData& d) {
  return d.n + static_cast<long>(d.groups.size() + d.forces->size() + d.user_forces.size()) +
         static_cast<long>(std::count_if(d.applied.begin(), d.applied.end(), depends_on_state));
}

}  // namespace mbsopt
