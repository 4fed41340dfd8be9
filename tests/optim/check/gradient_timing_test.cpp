#include "optim/check/gradient_timing.hpp"

#include <catch2/catch.hpp>

#include "optim/machine/median.hpp"
#include "optim/objective/objective.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;

TEST_CASE("the median is the middle one, the upper of two, 0 of none", "[timing]") {
  CHECK(median({3, 1, 2}) == 2);
  CHECK(median({4, 1, 3, 2}) == 3);
  CHECK(median({}) == 0);
}

TEST_CASE("gradients are timed in turn with simulations, in as many rounds as asked for", "[timing]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.5;
  const GradientTiming timing = time_gradients(problem.scene, objectives_of(problem), {3, 3, 0});
  REQUIRE(timing.ok);
  CHECK(timing.rounds == 3);
  CHECK(timing.simulations == 9);
  CHECK(timing.simulation.ratio == 1);
  CHECK(timing.adjoint.ratio > 0);  // how large is a matter of the machine's other work
  CHECK(timing.tlm.ratio > 0);
  CHECK(timing.rhs_evaluations > timing.steps);
}

TEST_CASE("rounds go on until the least time has passed, and never beyond the most", "[timing]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.1;
  CHECK(time_gradients(problem.scene, objectives_of(problem), {1, 4, 1e9}).rounds == 4);
  CHECK(time_gradients(problem.scene, objectives_of(problem), {5, 9, 0, 0}).rounds == 1);  // most_seconds: 0
}

TEST_CASE("a simulation that fails is no timing, and says why", "[timing]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.integrator.max_steps = 2;
  const GradientTiming timing = time_gradients(problem.scene, objectives_of(problem));
  CHECK_FALSE(timing.ok);
  CHECK_FALSE(timing.message.empty());
}
