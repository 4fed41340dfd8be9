// The meaning of a change of the total energy: the integrator's error, or the work of what does work.
#pragma once

#include "core/scene/scene.hpp"

namespace mbsopt {

// Whether springs with constant coefficients and gravity are all that acts, so that the total energy stays as it is.
bool conserves_energy(const Scene& scene);

// Said beside a change of energy where it is not conserved.
inline constexpr const char* kWorkIsDone = "with the work of dampers, actuators and laws, no measure of the error";

}  // namespace mbsopt
