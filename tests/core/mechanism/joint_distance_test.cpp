#include "core/mechanism/joint_distance.hpp"

#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"

using namespace mbsopt;

namespace {

// Bodies 1 to n; 0 is the ground.
MechanismData joined(int n, const std::vector<std::pair<int, int>>& joints) {
  MechanismData data;
  data.n = n;
  data.bodies.resize(static_cast<std::size_t>(n) + 1);
  for (const auto& [body1, body2] : joints) {
    RowGroup group;
    group.body1 = body1, group.body2 = body2;
    data.groups.push_back(group);
  }
  return data;
}

}  // namespace

TEST_CASE("the farthest body of a chain is as many joints away as there are rods, in whatever order they are listed",
          "[joint_distance]") {
  CHECK(joints_to_farthest_body(joined(4, {{0, 1}, {1, 2}, {2, 3}, {3, 4}})) == 4);
  CHECK(joints_to_farthest_body(joined(4, {{4, 3}, {2, 1}, {2, 3}, {1, 0}})) == 4);
}

TEST_CASE("a loop is as far as its shorter way", "[joint_distance]") {
  CHECK(joints_to_farthest_body(joined(3, {{0, 1}, {1, 2}, {2, 3}, {3, 0}})) == 2);
  CHECK(joints_to_farthest_body(joined(5, {{0, 1}, {1, 2}, {2, 3}, {0, 3}, {3, 4}, {4, 5}, {0, 5}})) == 2);
}

TEST_CASE("without joints nothing is far; bodies that hang together are so from the first of them",
          "[joint_distance]") {
  CHECK(joints_to_farthest_body(joined(3, {})) == 0);
  CHECK(joints_to_farthest_body(joined(5, {{0, 1}, {2, 3}, {3, 4}, {4, 5}})) == 3);
}
