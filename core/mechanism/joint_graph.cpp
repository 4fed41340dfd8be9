#include "core/mechanism/joint_graph.hpp"

#include <algorithm>
#include <numeric>
#include <set>
#include <vector>

#include "core/constraint/constraint.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

int joints_to_farthest_body(const MechanismData& data) {
  const std::size_t bodies = data.bodies.size();
  std::vector<std::vector<std::size_t>> neighbours(bodies);
  for (const RowGroup& g : data.groups) {
    const std::size_t a = static_cast<std::size_t>(g.body1), b = static_cast<std::size_t>(g.body2);
    neighbours[a].push_back(b), neighbours[b].push_back(a);
  }
  constexpr int kUnknown = -1;
  std::vector<int> distance(bodies, kUnknown);
  for (std::size_t first = 0; first < bodies; ++first) {  // the ground is the first
    if (distance[first] != kUnknown) continue;
    distance[first] = 0;
    for (std::vector<std::size_t> reached{first}; !reached.empty();) {
      std::vector<std::size_t> next;
      for (const std::size_t body : reached) {
        for (const std::size_t neighbour : neighbours[body]) {
          if (distance[neighbour] != kUnknown) continue;
          distance[neighbour] = distance[body] + 1;
          next.push_back(neighbour);
        }
      }
      reached = std::move(next);
    }
  }
  return *std::max_element(distance.begin(), distance.end());
}

bool closes_loops(const MechanismData& data) {
  std::vector<int> group(data.bodies.size());  // connected bodies, named by one of them
  std::iota(group.begin(), group.end(), 0);
  const auto leader = [&](int body) {
    const auto next = [&](int i) -> int& { return group[static_cast<std::size_t>(i)]; };
    while (next(body) != body) body = next(body) = next(next(body));  // halves the path
    return body;
  };
  std::set<int> joints;
  for (const Constraint& c : data.constraints) {
    if (c.drive >= 0) return true;
    if (!joints.insert(c.joint).second) continue;
    const int a = leader(c.body1), b = leader(c.body2);
    if (a == b) return true;
    group[static_cast<std::size_t>(b)] = a;
  }
  return false;
}

}  // namespace mbsopt
