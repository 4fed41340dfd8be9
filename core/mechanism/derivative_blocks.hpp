// The blocks of the derivatives of the equations of motion at one state: one block per
//   body                 its inertia forces
//   group of joint rows  Phi_q, (Phi_q v)_q, (Phi_q' lambda)_q between two bodies
//   force                on the bodies between which it acts, if it depends on the state
// A force that is the same in every state has none. MechanismData::slots() counts the numbers of the model that a
// parameter changes.
#pragma once

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

// Returns whether the load (force in global axes, moment in body axes) changes with the state.
bool depends_on_state(const AppliedForce& force);

long derivative_blocks(const MechanismData& data);

}  // namespace mbsopt
