// The graph of bodies and joints.
#pragma once

#include <cstddef>
#include <vector>

namespace mbsopt {

struct MechanismData;

using Neighbours = std::vector<std::vector<std::size_t>>;  // of each body
inline void join(int body1, int body2, Neighbours& neighbours) {
  const auto a = static_cast<std::size_t>(body1), b = static_cast<std::size_t>(body2);
  neighbours[a].push_back(b), neighbours[b].push_back(a);
}
// Sets the lengths of the shortest paths from the first body to those with the length -1, as far as paths lead. Returns
// these bodies.
std::vector<std::size_t> measure_paths(const Neighbours& neighbours, std::size_t first, std::vector<int>& lengths);

// The number of joints on the path to the body farthest from the ground, each by its shortest path; 0 without joints.
// If no joint leads from the ground to a group of bodies, paths start at its first body.
int joints_to_farthest_body(const MechanismData& data);

// Returns whether there is a loop of joints, or a drive. Otherwise the constraints' Jacobian never loses rank.
bool closes_loops(const MechanismData& data);

}  // namespace mbsopt
