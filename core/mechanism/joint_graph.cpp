#include "core/mechanism/joint_graph.hpp"

#include <algorithm>
#include <set>

#include "core/constraint/constraint.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

constexpr int kUnknown = -1;

// The number of joints from each body to the ground or, if none leads there, to the first body of its group.
struct Paths {
  std::vector<int> lengths;
  std::size_t groups = 0;

  explicit Paths(const MechanismData& data) {
    Neighbours neighbours(data.bodies.size());
    for (const RowGroup& g : data.groups) join(g.body1, g.body2, neighbours);
    lengths.assign(neighbours.size(), kUnknown);
    for (std::size_t first = 0; first < lengths.size(); ++first) {  // the ground is the first
      if (lengths[first] != kUnknown) continue;
      measure_paths(neighbours, first, lengths);
      ++groups;
    }
  }
};

}  // namespace

std::vector<std::size_t> measure_paths(const Neighbours& neighbours, std::size_t first, std::vector<int>& lengths) {
  lengths[first] = 0;
  std::vector<std::size_t> reached{first};
  for (std::size_t k = 0; k < reached.size(); ++k) {
    for (const std::size_t next : neighbours[reached[k]]) {
      if (lengths[next] != kUnknown) continue;
      lengths[next] = lengths[reached[k]] + 1;
      reached.push_back(next);
    }
  }
  return reached;
}

int joints_to_farthest_body(const MechanismData& data) { return std::ranges::max(Paths(data).lengths); }

bool closes_loops(const MechanismData& data) {
  std::set<int> joints;
  for (const Constraint& c : data.constraints) {
    if (c.drive >= 0) return true;
    joints.insert(c.joint);
  }
  return joints.size() + Paths(data).groups > data.bodies.size();  // more joints than a tree has
}

}  // namespace mbsopt
