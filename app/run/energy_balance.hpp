// The meaning of a change of the total energy: the integrator's error, or the work of forces.
#pragma once

#include "core/scene/scene.hpp"

namespace mbsopt {

// Returns whether only gravity and springs with constant coefficients act, so that the total energy is constant.
bool conserves_energy(const Scene& scene);

// These words follow a change of energy that is not conserved.
inline constexpr const char* kWorkIsDone = "with the work of dampers, actuators and laws, no measure of the error";

}  // namespace mbsopt
