// Limits on extremes hold for the true ones, whatever the method; what limits cost; which of them stand against each
// other.
#include <catch2/catch.hpp>

#include "optim/design/design.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

// A mass on a spring moves as x = a cos(2 t) over 5 s, its extremes are a and -a. Minimised is (a - 1)^2.
Problem swing(std::vector<ObjectiveBound> limits) {
  Problem problem;
  problem.scene = swinging_mass({{"a", 0.2}}, "-4*x", 5);
  Scene& s = problem.scene;
  s.parameters[0].lower = 0.1, s.parameters[0].upper = 2;
  s.simulation.integrator.max_step = 0.05;
  ObjectiveSpec near_one;
  near_one.name = "near_one", near_one.parameters_only = f("(a - 1)^2");
  problem.objectives = {near_one};
  problem.design.emplace();
  problem.design->minimize = "near_one", problem.design->variables = {"a"};
  problem.design->subject_to = std::move(limits);
  return problem;
}

ObjectiveBound limit(std::string_view kind, const std::string& of, std::optional<double> lower,
                     std::optional<double> upper, double sharpness = 6) {
  ObjectiveBound bound;
  bound.lower = lower, bound.upper = upper, bound.sharpness = sharpness;
  bound.means[static_cast<std::size_t>(std::ranges::find(kMeanKinds, kind, &MeanKind::name) - kMeanKinds)] = f(of);
  return bound;
}

}  // namespace

TEST_CASE("a limit on an extreme holds for the true one and is used, with its price", "[true_limits]") {
  struct Case {
    ObjectiveBound limit;
    double a, price;  // of 1 - a = the gradient (a - 1)^2 has at the limit, per unit of the limit
  };
  const Case c = GENERATE(
      Case{limit("maximum_of", "x", {}, 0.5), 0.5, 1}, Case{limit("minimum_of", "x", -0.6, {}), 0.6, 0.8},
      Case{limit("peak_to_peak_of", "x", 0.1, 0.9), 0.45, 0.55}, Case{limit("maximum_of", "x", 1.4, {}), 1.4, 0.8},
      Case{limit("maximum_of", "3*x", {}, 0.9), 0.3, 1.4 / 3});
  Problem problem = swing({c.limit});
  problem.design->optimizer.type = GENERATE(as<std::string>{}, "auto", "ipopt", "slsqp", "mma", "cobyla", "isres");
  if (problem.design->optimizer.type == "isres") {
    problem.design->optimizer.seed = 2;
    if (c.limit.lower) return;  // one limit is enough for it
  }
  const DesignResult result = run_design(problem);
  INFO(problem.design->optimizer.type << ": " << result.message << " a = " << result.variables[0].value);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.optimizer == "sqp");  // which goes on from the end of others with true extremes
  const DesignConstraint& held = result.constraints[0];
  REQUIRE(held.true_value);
  if (held.upper) CHECK(*held.true_value <= *held.upper);
  if (held.lower) CHECK(*held.true_value >= *held.lower);
  CHECK(held.true_violation == 0);
  // 1e-6 of the limit, which is 3 a where that is bounded
  CHECK(result.variables[0].value == Approx(c.a).epsilon(2e-6));
  CHECK(held.price == Approx(c.price).epsilon(1e-5));
}

TEST_CASE("an equality of a true extreme is met to 1e-6", "[true_limits]") {
  const DesignResult result = run_design(swing({limit("maximum_of", "x", 0.5, 0.5)}));
  CHECK(result.status == SolverStatus::converged);
  CHECK(std::abs(*result.constraints[0].true_value - 0.5) < 1e-6 * 0.5);
  CHECK(result.constraints[0].price == Approx(1).epsilon(1e-3));
}

// The price is small beside the objective. So multiplier times slack, the optimality condition, is below the tolerance
// far inside the limit.
TEST_CASE("a limit of a small price is used to the last, too, and is at its bound", "[true_limits]") {
  Problem problem = swing({limit("maximum_of", "x", {}, 0.99)});
  problem.objectives[0].parameters_only = f("30 + (a - 1)^2");
  problem.design->optimizer.type = GENERATE(as<std::string>{}, "auto", "ipopt", "slsqp");
  const DesignResult result = run_design(problem);
  INFO(problem.design->optimizer.type << ": " << result.message << " a = " << result.variables[0].value);
  CHECK(result.status == SolverStatus::converged);
  const DesignConstraint& held = result.constraints[0];
  CHECK(*held.true_value <= 0.99);
  CHECK(*held.true_value == Approx(0.99).epsilon(1e-6));
  CHECK(held.price == Approx(0.02).epsilon(1e-2));
  CHECK(held.at_upper);
  CHECK(result.is_at_boundary());
  CHECK(result.warnings.empty());
}

TEST_CASE("a limit on an extreme that does not bind has no price", "[true_limits]") {
  const DesignResult result = run_design(swing({limit("maximum_of", "x", {}, 1.5)}));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.constraints[0].price == 0);
  CHECK(result.variables[0].value == Approx(1).epsilon(1e-5));
}

TEST_CASE("limits that cannot hold together are named, with what they are missed by or their prices", "[true_limits]") {
  const std::string type = GENERATE(as<std::string>{}, "auto", "ipopt", "slsqp");
  // a <= 0.5, but 2 a >= 1.5
  Problem problem = swing({limit("maximum_of", "x", {}, 0.5), limit("peak_to_peak_of", "x", 1.5, {})});
  problem.design->optimizer.type = type;
  const DesignResult result = run_design(problem);
  INFO(result.message);
  CHECK(result.status == SolverStatus::infeasible);
  REQUIRE(result.conflicts.size() == 2);
  CHECK(result.conflicts[0].limit == "maximum_of x <= 0.5");
  CHECK(result.conflicts[1].limit == "peak_to_peak_of x >= 1.5");
  CHECK(result.conflicts[0].missed + result.conflicts[1].missed > 0.1);
  CHECK_THAT(result.message,
             Contains("in conflict: ") && Contains("maximum_of x <= 0.5") && Contains("peak_to_peak_of x >= 1.5"));
  CHECK(result.warnings.empty());  // more sharpness would not help
}

TEST_CASE("a bound of a variable is named where it keeps a limit from holding", "[true_limits]") {
  Problem problem = swing({limit("maximum_of", "x", 3.0, {})});
  const DesignResult result = run_design(problem);
  INFO(result.message);
  CHECK(result.status == SolverStatus::infeasible);
  REQUIRE(result.conflicts.size() == 2);
  CHECK(result.conflicts[0].limit == "maximum_of x >= 3");
  CHECK(result.conflicts[0].price == Approx(1.0 / 3));  // of the violation relative to the limit
  CHECK(result.conflicts[1].limit == "a <= 2");
  // The smooth maximum grows with a, and so do 3 times the relative violation.
  CHECK(result.conflicts[1].price == Approx(result.final_evaluation.psi_rho(1, 0) / 3).epsilon(1e-12));
}
