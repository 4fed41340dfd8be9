// The graph of bodies and joints.
#pragma once

namespace mbsopt {

struct MechanismData;

// The number of joints on the path to the body farthest from the ground, each by its shortest path; 0 without joints.
// If no joint leads from the ground to a group of bodies, paths start at its first body.
int joints_to_farthest_body(const MechanismData& data);

// Returns whether there is a loop of joints, or a drive. Otherwise the constraints' Jacobian never loses rank.
bool closes_loops(const MechanismData& data);

}  // namespace mbsopt
