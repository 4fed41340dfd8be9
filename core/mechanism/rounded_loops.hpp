// Loops whose redundant equations agree only within the rounding of their numbers, as of a linkage whose pivots and
// axes leave its plane in the seventh digit. Taken literally, such a loop is rigid, or open.
//
// L(q) is the left null space of J = Phi_q, L'J = 0, where the joints are closed as far as possible. In an
// overconstrained loop it exists along the whole motion. The loop moves if and only if L'Phi = 0 along the motion.
// Let x displace the joints' places on their bodies. The nearest geometry that moves is
//
//   min |x|   subject to   L_k'(Phi_k + Phi_x,k dx) = 0   at positions q_k along the motion          x: x_old + dx
//
// by Gauss-Newton steps; x holds shifts in lengths of the bodies, and turns. Further positions join until new ones
// satisfy it to rounding. With this geometry all that follows is exact, as for numbers with all digits.
//
// Singular positions (bars in line) are none of this, since positions next to them have no L. A short link or an axis
// tilted on purpose would need an x beyond the tolerance.
#pragma once

#include <string>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/scene_programs.hpp"

namespace mbsopt {

// The lengths against which changes of geometry count.
struct JointLengths {
  double whole = 1;            // of the largest body [m]; 1 if all joints are in one point
  std::vector<double> bodies;  // between the joints of each body, the ground first; `whole` if these are in one point
};
JointLengths joint_lengths(const MechanismData& data);

// Moves points and axes of data.constraints if that takes no more than the tolerance: turns in rad, shifts in lengths
// of the mechanism, and by far less than a body's own length. Sets data.rounded also if it takes more. A tolerance of 0
// changes nothing. Derivatives hold x fixed. Where equations are independent at one geometry, they are at almost every
// one: `known` keeps that for other parameter values of the scene.
void close_rounded_loops(MechanismData& data, double tolerance, IndependentLoops& known);

// data.rounded in words, for a warning (made) or after a failed assembly.
std::string in_words(const MechanismData& data);

}  // namespace mbsopt
