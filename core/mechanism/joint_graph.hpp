// How joints hang together.
#pragma once

namespace mbsopt {

struct MechanismData;

// Joints on the way to the body farthest from the ground, each by its shortest way; 0 without joints. Of bodies that no
// joint leads to: from the first of those that hang together.
int joints_to_farthest_body(const MechanismData& data);

// Whether there is a loop of joints, or a drive. Without them the constraints' Jacobian never loses rank.
bool closes_loops(const MechanismData& data);

}  // namespace mbsopt
