#include "core/mechanism/joint_graph.hpp"
#include "core/constraint/constraint.hpp"

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
    Constraint c;
    c.body1 = body1, c.body2 = body2, c.joint = static_cast<int>(data.constraints.size());
    data.constraints.push_back(c);
  }
  return data;
}

}  // namespace

TEST_CASE("the farthest body of a chain is as many joints away as there are rods, in whatever order they are listed",
          "[joint_graph]") {
  CHECK(joints_to_farthest_body(joined(4, {{0, 1}, {1, 2}, {2, 3}, {3, 4}})) == 4);
  CHECK(joints_to_farthest_body(joined(4, {{4, 3}, {2, 1}, {2, 3}, {1, 0}})) == 4);
}

TEST_CASE("a loop is as far as its shorter way", "[joint_graph]") {
  CHECK(joints_to_farthest_body(joined(3, {{0, 1}, {1, 2}, {2, 3}, {3, 0}})) == 2);
  CHECK(joints_to_farthest_body(joined(5, {{0, 1}, {1, 2}, {2, 3}, {0, 3}, {3, 4}, {4, 5}, {0, 5}})) == 2);
}

TEST_CASE("without joints nothing is far; bodies that hang together are so from the first of them", "[joint_graph]") {
  CHECK(joints_to_farthest_body(joined(3, {})) == 0);
  CHECK(joints_to_farthest_body(joined(5, {{0, 1}, {2, 3}, {3, 4}, {4, 5}})) == 3);
}

TEST_CASE("chains and trees close no loops; rings, second joints of a pair and drives do", "[joint_graph]") {
  CHECK_FALSE(closes_loops(joined(0, {})));
  CHECK_FALSE(closes_loops(joined(5, {{0, 1}, {2, 1}, {3, 2}, {2, 4}})));
  CHECK(closes_loops(joined(3, {{0, 1}, {1, 2}, {2, 3}, {3, 0}})));
  CHECK(closes_loops(joined(2, {{0, 1}, {1, 2}, {2, 1}})));
  MechanismData driven = joined(2, {{0, 1}, {1, 2}});
  driven.constraints.back().drive = 0;
  CHECK(closes_loops(driven));
  MechanismData hinge = joined(1, {{0, 1}, {0, 1}});
  hinge.constraints[1].joint = 0;  // further rows of the same joint
  CHECK_FALSE(closes_loops(hinge));
}
