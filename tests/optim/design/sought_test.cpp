// What a design seeks: maxima, weighted sums, the largest of several objectives. Closed forms.
#include <catch2/catch.hpp>

#include "optim/design/design.hpp"
#include "optim/objective/problem_issues.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

ObjectiveSpec of_parameters(const std::string& name, const std::string& expression) {
  ObjectiveSpec spec;
  spec.name = name, spec.parameters_only = f(expression);
  return spec;
}

WeightedObjective largest_x(double weight) {
  WeightedObjective term;
  term.weight = weight;
  term.means[static_cast<std::size_t>(std::ranges::find(kMeanKinds, "maximum_of", &MeanKind::name) - kMeanKinds)] =
      f("x");
  return term;
}

// A mass moves as x = a cos(2 t) over 5 s, so that the largest x is a.
Problem swing() {
  Problem problem;
  problem.scene = swinging_mass({{"a", 0.2}}, "-4*x", 5);
  problem.scene.parameters[0].lower = 0.1, problem.scene.parameters[0].upper = 2;
  problem.scene.simulation.integrator.max_step = 0.05;
  problem.objectives = {of_parameters("near_one", "(a - 1)^2")};
  problem.design.emplace();
  problem.design->variables = {"a"};
  return problem;
}

DesignResult solved(const Problem& problem) {
  const DesignResult result = run_design(problem);
  INFO(problem.design->optimizer.type << ": " << result.message);
  CHECK(result.status == SolverStatus::converged);
  return result;
}

}  // namespace

TEST_CASE("what is maximised is reported as it is, and a limit has the price of its rise", "[sought]") {
  Problem problem = swing();
  problem.objectives.push_back(of_parameters("good", "3 - (a - 1)^2"));
  problem.objectives.push_back(of_parameters("amplitude", "a"));
  problem.design->maximize = "good";
  problem.design->optimizer.type = GENERATE(as<std::string>{}, "auto", "ipopt", "slsqp", "cobyla");
  DesignResult result = solved(problem);
  CHECK(result.objective == "good");
  CHECK(result.objective_initial == Approx(3 - 0.64));
  CHECK(result.objective_final == Approx(3).epsilon(1e-9));
  CHECK(result.variables[0].value == Approx(1).epsilon(1e-4));
  CHECK(result.history.front().objective == Approx(result.objective_initial));

  problem.design->subject_to = {{"amplitude", {}, 0.5}};
  result = solved(problem);
  CHECK(result.objective_final == Approx(2.75).epsilon(1e-6));
  CHECK(result.constraints[0].price == Approx(1).epsilon(1e-3));  // 2 (1 - a)
}

TEST_CASE("a weighted sum takes objectives and extremes, with weights of both signs", "[sought]") {
  Problem problem = swing();
  const double weight = GENERATE(0.5, -0.5);
  problem.design->sum = {{"near_one", 1}, largest_x(weight)};
  problem.design->optimizer.type = GENERATE(as<std::string>{}, "auto", "ipopt", "slsqp");
  const DesignResult result = solved(problem);
  const double a = 1 - weight / 2;  // 2 (a - 1) + weight = 0
  CHECK(result.variables[0].value == Approx(a).epsilon(1e-5));
  REQUIRE(result.objective_true);
  CHECK(*result.objective_true == Approx((a - 1) * (a - 1) + weight * a).epsilon(1e-6));
  CHECK(result.objective == (weight > 0 ? "near_one + 0.5 maximum_of x" : "near_one - 0.5 maximum_of x"));
  REQUIRE(result.terms.size() == 2);
  CHECK(result.terms[1].true_value.value_or(0) == Approx(a).epsilon(1e-5));
  CHECK(result.terms[0].initial == Approx(0.64));
}

TEST_CASE("the largest of several objectives is least where they meet", "[sought]") {
  Problem problem = swing();
  problem.objectives.push_back(of_parameters("falling", "2.5 - a^2"));
  ObjectiveSpec largest;
  largest.name = "peak", largest.means = largest_x(1).means;
  problem.objectives.push_back(largest);
  problem.objectives.push_back(of_parameters("low", "0.1*a"));
  problem.design->largest_of = {"falling", "peak", "low"};
  problem.design->optimizer.type = GENERATE(as<std::string>{}, "auto", "ipopt");
  const DesignResult result = solved(problem);
  const double a = (std::sqrt(11.0) - 1) / 2;  // a = 2.5 - a^2
  CHECK(result.variables[0].value == Approx(a).epsilon(1e-6));
  CHECK(result.objective_true.value_or(0) == Approx(a).epsilon(1e-6));
  CHECK(result.optimality < 1e-6);
}

TEST_CASE("a sum counts its terms in every load case, by the weight of the case", "[sought]") {
  Problem problem = swing();
  add_parameters(problem.scene, {{"b", 0.0}});
  problem.objectives = {of_parameters("near", "(a - b)^2"), of_parameters("size", "a")};
  problem.cases.resize(2);
  problem.cases[0].name = "left", problem.cases[1].name = "right";
  problem.cases[1].weight = 3;
  problem.cases[1].overrides = {{"b", f("2")}};
  problem.design->sum = {{"near", 1}, {"size", 0.5}};
  const DesignResult result = solved(problem);
  CHECK(result.variables[0].value == Approx(1.25).epsilon(1e-6));  // 2 a + 0.5 + 3 (2 (a - 2) + 0.5) = 0
  CHECK(result.cases[1].value == Approx(0.5625 + 0.625).epsilon(1e-6));
}

TEST_CASE("a design seeks one thing, and its sum has weights", "[sought]") {
  Problem problem = swing();
  const auto words = [&] {
    const std::vector<SceneIssue> issues = find_issues(problem);
    return issues.empty() ? std::string() : issues[0].path + ": " + issues[0].message;
  };
  CHECK_THAT(words(), Contains("design.minimize: is missing"));
  problem.design->minimize = "near_one";
  CHECK(words().empty());
  problem.design->maximize = "near_one";
  CHECK_THAT(words(), Contains("give one of them"));
  problem.design->minimize = problem.design->maximize = "";
  problem.design->sum = {{"near_one", 0}};
  CHECK_THAT(words(), Contains("design.minimize.sum[0].weight: is 0"));
}
