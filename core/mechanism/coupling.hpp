// The pattern of the derivatives of the equations of motion: the bodies whose coordinates occur in those of each body.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

struct Coupling {
  // bodies[i - 1] lists the moving bodies (1-based, ascending) whose q and v occur in the six equations of body i, with
  // i itself.
  std::vector<std::vector<int>> bodies;
  // The moving bodies that each row of Phi ties.
  std::vector<std::vector<int>> rows;
};

Coupling coupling(const MechanismData& data);

// Returns whether the load (force in global axes, moment in body axes) changes with the state.
bool depends_on_state(const AppliedForce& force);

// The number of blocks of the derivatives of the equations of motion at one state, one per
//   body                 its inertia forces
//   group of joint rows  Phi_q, (Phi_q v)_q, (Phi_q' lambda)_q between two bodies
//   force                on the bodies between which it acts, if it depends on the state
// MechanismData::slots() counts the numbers of the model that a parameter changes.
long derivative_blocks(const MechanismData& data);

}  // namespace mbsopt
