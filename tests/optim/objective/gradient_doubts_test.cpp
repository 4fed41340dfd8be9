#include "optim/objective/gradient_doubts.hpp"

#include <catch2/catch.hpp>

#include "optim/check/gradient_check.hpp"
#include "tests/optim/stopped_body.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

std::vector<std::string> doubts(const Problem& problem, GradientMethod method, double* slope = nullptr) {
  EvaluatorOptions options;
  options.method = method;
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  const Evaluation& e = evaluator.gradients(evaluator.start());
  INFO(e.message);
  REQUIRE(e.ok);
  if (slope) *slope = e.psi_rho(0, 0);
  return gradient_doubts(evaluator, e);
}

}  // namespace

TEST_CASE(
    "a gradient through a stop that the steps do not know is said to be wrong, unless sensitivities choose the steps",
    "[gradient]") {
  const GradientMethod method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint, GradientMethod::cvodes_forward);
  double slope = 0;
  Problem problem = mbsopt::testing::stopped_body();
  if (method != GradientMethod::cvodes_forward) {
    CHECK(doubts(problem, method, &slope).empty());
    CHECK(slope == Approx(1).epsilon(1e-6));
    problem.scene.simulation.follows_kinks = false;
  }
  const std::vector<std::string> said = doubts(problem, method, &slope);
  INFO("d end/d h = " << slope);
  if (method == GradientMethod::cvodes_forward) {  // controls the error of the sensitivities
    CHECK(slope == Approx(1).epsilon(1e-6));
    CHECK(said.empty());
    return;
  }
  REQUIRE(std::abs(slope - 1) > 1e-3);
  REQUIRE(said.size() == 1);
  CHECK_THAT(said[0], Contains("the gradient of objective 'end' is wrong") && Contains("force 'stop' has a kink"));
}

TEST_CASE("a gradient through a rounded stop, or along a stop that is not met, is not doubted", "[gradient]") {
  const char* const force = GENERATE("-2500*(x + smooth_abs(x, 0.05))", "-5000*max(0, x - 2)", "-5000*max(0, x)^4");
  double slope = 0;
  const std::vector<std::string> said = doubts(mbsopt::testing::stopped_body(force), GradientMethod::tlm, &slope);
  INFO(force << ", d end/d h = " << slope);
  for (const std::string& w : said) UNSCOPED_INFO(w);
  CHECK(said.empty());
}

// CVODES does not project, and the acceleration of 2.5e6 rad/s^2 tears the hinges apart by 1e-4 of their lengths.
TEST_CASE("a gradient along a motion that leaves the constraints is doubted", "[gradient]") {
  Problem problem;
  Scene& s = problem.scene = mbsopt::testing::double_pendulum();
  mbsopt::testing::add_parameters(s, {{"phi", 0.4}});
  Drive drive;
  const std::string u = "min(1, max(0, (t - 0.7)/1e-3))";
  drive.name = "jerk", drive.type = "angle", drive.joint = "A";
  drive.law = mbsopt::testing::f("theta0 - 0.6 + phi*(3*(" + u + ")^2 - 2*(" + u + ")^3)");
  s.drives = {drive};
  s.simulation.end_time = 3;
  s.simulation.integrator.type = "cvodes_adams";
  ObjectiveSpec objective;
  objective.name = "end", objective.terminal = mbsopt::testing::f("theta2");
  problem.objectives = {objective};
  double slope = 0;
  const std::vector<std::string> said = doubts(problem, GradientMethod::automatic, &slope);
  INFO("d end/d phi " << slope);
  REQUIRE(said.size() == 1);
  CHECK_THAT(said[0], Contains("do not resolve the gradient of objective 'end'"));
  s.simulation.integrator.type = "dopri853";
  CHECK(doubts(problem, GradientMethod::automatic, &slope).empty());
}

TEST_CASE("the check does not pass a gradient that differences of free runs contradict", "[check]") {
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  Problem problem = mbsopt::testing::stopped_body();
  CHECK(check_gradients(problem, options).passed());
  problem.scene.simulation.follows_kinks = false;
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  const CheckedEntry& e = check.entries[0];
  INFO(e.tlm << ", differences " << e.free << " +- " << e.free_error);
  CHECK(e.free == Approx(1).epsilon(1e-4));
  CHECK_FALSE(passes(*e.free_verdict));
  CHECK_FALSE(check.passed());
}
