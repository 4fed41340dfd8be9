// Load cases: each is the problem that a user would write by hand; threads change nothing; the smooth maximum over
// cases.
#include <catch2/catch.hpp>
#include <cmath>

#include "optim/check/gradient_check.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/case_objective.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/problem/load_cases.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// A mass at x = a cos(w t), w = sqrt(k), over 1 s; in cases with other k, a and end time.
Problem loaded_swing() {
  Problem problem;
  problem.scene = swinging_mass({{"k", 4.0}, {"a", 0.3}, {"b", 0.1}}, "-twice/2*x", 1, 1e-11);
  problem.scene.definitions.push_back({"twice", f("2*k")});
  ObjectiveSpec end;
  end.name = "end", end.terminal = f("x"), end.parameters_only = f("0*b");
  problem.objectives = {end};
  CaseSpec stiff, small, swapped;
  stiff.name = "stiff", stiff.overrides = {{"k", f("1.5*k + b")}};
  small.name = "small", small.overrides = {{"a", f("0.1")}}, small.end_time = 2;
  swapped.name = "swapped", swapped.overrides = {{"k", f("10*a")}, {"a", f("k/8")}};
  problem.cases = {stiff, small, swapped};
  return problem;
}

double end_of(double k, double a, double T) { return a * std::cos(std::sqrt(k) * T); }
double slope_of(double k, double a, double T) { return -a * std::sin(std::sqrt(k) * T) * T / (2 * std::sqrt(k)); }

}  // namespace

TEST_CASE("values and gradients in cases are those of the closed form, by the chain rule", "[cases]") {
  EvaluatorOptions options;
  options.method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint, GradientMethod::differences);
  const double accuracy = options.method == GradientMethod::differences ? 1e-6 : 1e-9;
  options.threads = 2;
  Evaluator evaluator(loaded_swing(), {"end"}, {"k", "a", "b"}, options);
  const Evaluation e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  CHECK(e.psi(0) == Approx(end_of(6.1, 0.3, 1)).epsilon(1e-9));
  CHECK(e.psi(1) == Approx(end_of(4, 0.1, 2)).epsilon(1e-9));
  CHECK(e.psi(2) == Approx(end_of(3, 0.5, 1)).epsilon(1e-9));
  Eigen::MatrixXd expected(3, 3);
  const double s = slope_of(6.1, 0.3, 1);
  expected << 1.5 * s, std::cos(std::sqrt(6.1)), s,  //
      slope_of(4, 0.1, 2), 0, 0,                     //
      std::cos(std::sqrt(3.0)) / 8, 10 * slope_of(3, 0.5, 1), 0;
  INFO(e.psi_rho << "\n\n" << expected);
  CHECK((e.psi_rho - expected).cwiseAbs().maxCoeff() < accuracy);
}

TEST_CASE("the gradients of a case agree: tlm, adjoint, differences", "[cases]") {
  Problem problem = problem_of(loaded_swing(), loaded_swing().cases[GENERATE(0u, 1u, 2u)]);
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  const GradientCheck check = check_gradients(problem);
  REQUIRE(check.ran);
  CHECK(check.passed());
}

TEST_CASE("the derivatives of sum and smooth maximum over cases are those of their values", "[cases]") {
  DesignSpec design;
  design.over = GENERATE(as<std::string>{}, "sum", "max");
  design.sharpness = 3;
  std::vector<CaseSpec> cases(3);
  cases[1].weight = 2;
  const CaseObjective f(cases, design);
  const Eigen::Vector3d psi(0.7, 0.4, 0.5);
  for (Eigen::Index c = 0; c < 3; ++c) {
    const Eigen::Vector3d h = 1e-5 * Eigen::Vector3d::Unit(c);
    CHECK(f.gradient(psi)(c) == Approx((f.value(psi + h) - f.value(psi - h)) / 2e-5).epsilon(1e-8));
    const Eigen::VectorXd slope = (f.gradient(psi + h) - f.gradient(psi - h)) / 2e-5;
    CHECK((f.hessian(psi).col(c) - slope).norm() < 1e-8);
  }
  if (design.over == "sum") {
    CHECK(f.value(psi) == Approx(2.0));
    return;
  }
  CHECK(f.true_value(psi) == Approx(0.8));
  CHECK(f.value(psi) > 0.8);
  CHECK(f.value(psi) <= 0.8 + std::log(3.0) / 3);
}

TEST_CASE("a design over cases: sum and maximum have their closed optimum, limits hold in each case", "[cases]") {
  // (a - 1)^2 and (a - 3)^2 with weights 1 and 3: their sum is least at 2.5, their maximum where they are equal.
  Problem problem = loaded_swing();
  problem.objectives[0].terminal = f("0*x"), problem.objectives[0].parameters_only = f("(a - b)^2");
  CaseSpec one, three;
  one.name = "one", one.overrides = {{"b", f("1")}};
  three.name = "three", three.overrides = {{"b", f("3")}}, three.weight = 3;
  problem.cases = {one, three};
  problem.design.emplace();
  problem.design->minimize = "end", problem.design->variables = {"a"};
  problem.design->optimizer.type = GENERATE("ipopt", "slsqp");
  const DesignResult sum = run_design(problem);
  CHECK(sum.status == SolverStatus::converged);
  CHECK(sum.variables[0].value == Approx(2.5).epsilon(1e-5));
  CHECK(sum.objective_final == Approx(3.0).epsilon(1e-8));
  REQUIRE(sum.cases.size() == 2);
  CHECK(sum.cases[1].value == Approx(0.25).epsilon(1e-4));
  problem.design->over = "max", problem.design->sharpness = 1000;
  const DesignResult most = run_design(problem);
  INFO(most.message);
  const double equal = (3 * std::sqrt(3.0) + 1) / (1 + std::sqrt(3.0));  // a - 1 = sqrt(3) (3 - a)
  CHECK(most.status == SolverStatus::converged);
  CHECK(most.variables[0].value == Approx(equal).epsilon(1e-3));  // of log(2)/k
  REQUIRE(most.objective_true);
  CHECK(most.objective_final > *most.objective_true);
  CHECK(most.objective_final < *most.objective_true + std::log(2.0) / 1000 + 1e-9);
  // x starts at a, whose maximum is a: held at 2 in both cases.
  problem.design->over = "sum", problem.design->sharpness.reset();
  ObjectiveBound limit;
  limit.means[0] = f("x"), limit.upper = 2;
  problem.design->subject_to = {limit};
  const DesignResult held = run_design(problem);
  CHECK(held.status == SolverStatus::converged);
  REQUIRE(held.constraints.size() == 2);
  CHECK(held.constraints[1].in_words() == "maximum_of x (three)");
  for (const DesignConstraint& c : held.constraints) CHECK(*c.true_value <= 2);
  CHECK(held.variables[0].value == Approx(2).epsilon(1e-5));
}

TEST_CASE("what is said of a case names parameters as the problem does", "[cases]") {
  Problem problem = loaded_swing();
  Evaluator evaluator(problem, {"end"}, {"k", "a", "b"});
  CHECK(evaluator.in_case(0, "k_of_problem moves a jump") == "k moves a jump (stiff)");
  problem.scene.forces.clear();
  PointForce pull;
  pull.body = "mass", pull.components = {f("1/(t - 0.5)"), f("0"), f("0")};
  problem.scene.forces.push_back({"pull", pull});
  Evaluator failing(problem, {"end"}, {"k", "a", "b"});
  const Evaluation e = failing.values(failing.start());
  CHECK_FALSE(e.ok);  // no maximum over the cases that did not fail
  CHECK(e.message.starts_with("case 'stiff': "));
}
