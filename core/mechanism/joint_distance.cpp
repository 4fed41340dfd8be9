#include "core/mechanism/joint_distance.hpp"

#include <algorithm>
#include <vector>

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

}  // namespace mbsopt
