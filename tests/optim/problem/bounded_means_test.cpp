#include "optim/problem/bounded_means.hpp"

#include <catch2/catch.hpp>
#include <set>

using namespace mbsopt;

TEST_CASE("limits at instants late in time have names and times of their own", "[problem]") {
  Problem problem;
  problem.scene.simulation.start_time = 1000, problem.scene.simulation.end_time = 1001;
  ObjectiveBound& bound = problem.design.emplace().subject_to.emplace_back();
  bound.sampled = Expression::parse("a"), bound.every = 1e-3, bound.upper = 2;
  name_bounded_means(problem);
  REQUIRE(problem.design->subject_to.size() == 1001);
  std::set<std::string> names;
  for (const ObjectiveBound& limit : problem.design->subject_to) names.insert(limit.objective);
  CHECK(names.size() == 1001);
  CHECK(problem.design->subject_to[3].objective == "a at 1000.003 s");
  CHECK(problem.objectives.back().samples[0].time == 1001);
}
