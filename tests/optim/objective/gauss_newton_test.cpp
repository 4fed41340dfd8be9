#include "optim/objective/gauss_newton.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <cmath>

#include "optim/design/design.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/objective/problem_issues.hpp"
#include "tests/optim/five_bar.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

ObjectiveSpec named(const std::string& name) {
  ObjectiveSpec spec;
  spec.name = name;
  return spec;
}

double largest(const MatrixXd& x) { return x.cwiseAbs().maxCoeff(); }

// A swing of 1.5 s, of which objectives are made that are sensors alone at some times: their gradients are J, row by
// row.
Problem swing() {
  Problem p = pendulum::problem(20, 0.3, 2.0, 0.5);
  p.scene.simulation.end_time = 1.5;
  return p;
}

struct Found {
  Evaluation at;
  Hessians H;
};

Found found_in(Problem problem, const std::vector<ObjectiveSpec>& objectives,
               const std::vector<std::string>& variables = {}) {
  problem.objectives = objectives;
  Evaluator evaluator(problem.scene, objectives_of(problem), variables);
  const Evaluation at = evaluator.gradients(evaluator.start());
  REQUIRE(at.ok);
  return {at, gauss_newton(evaluator, at)};
}

}  // namespace

TEST_CASE("Gauss-Newton of squared deviations is 2 J'J, J from the gradients of what deviates", "[gauss_newton]") {
  const double times[] = {0.4, 0.9, 1.5};
  ObjectiveSpec squares = named("squares");
  squares.samples = {{times[0], testing::f("(theta - 2.2)^2")}, {times[1], testing::f("4*(theta - w2/9)^2")}};
  squares.terminal = testing::f("(theta - 2.9)^2");
  std::vector<ObjectiveSpec> objectives{squares, named("a"), named("b"), named("c")};
  objectives[1].samples = {{times[0], testing::f("theta")}};
  objectives[2].samples = {{times[1], testing::f("2*(theta - w2/9)")}};
  objectives[3].terminal = testing::f("theta");
  const auto [at, H] = found_in(swing(), objectives);
  REQUIRE(H.ok);
  const MatrixXd J = at.psi_rho.bottomRows(3), expected = 2 * J.transpose() * J;
  CHECK(largest(H.of[0].value - expected) < 1e-9 * largest(expected));
  for (const Index i : {1, 2, 3}) CHECK(largest(H.of[static_cast<std::size_t>(i)].value) == 0);  // linear
}

TEST_CASE("Gauss-Newton of an integral of squares is the integral of 2 J'J", "[gauss_newton]") {
  // By Simpson's rule on samples, fine enough for 1e-7.
  constexpr int n = 200;
  std::vector<ObjectiveSpec> objectives{named("square")};
  objectives[0].running = testing::f("(theta - 2.5 + 0.1*t)^2");
  for (int i = 0; i <= n; ++i) {
    objectives.push_back(named("s" + std::to_string(i)));
    objectives.back().samples = {{1.5 * i / n, testing::f("theta")}};
  }
  const auto [at, H] = found_in(swing(), objectives);
  REQUIRE(H.ok);
  MatrixXd expected = MatrixXd::Zero(at.psi_rho.cols(), at.psi_rho.cols());
  for (int i = 0; i <= n; ++i) {
    const double weight = 1.5 / n / 3 * (i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2);
    expected += 2 * weight * at.psi_rho.row(1 + i).transpose() * at.psi_rho.row(1 + i);
  }
  INFO(largest(H.of[0].value - expected) / largest(expected));
  CHECK(largest(H.of[0].value - expected) < 1e-6 * largest(expected));
}

TEST_CASE("Gauss-Newton is exact where no second derivatives of the motion come in", "[gauss_newton]") {
  // Expressions of parameters and time: every kind of objective, its chain rule and all.
  std::vector<ObjectiveSpec> objectives{named("sum"),   named("rms"),   named("most"),
                                        named("least"), named("sharp"), named("width")};
  objectives[0].running = testing::f("sin(t*w2/10)*c + w2^2*t/100");
  objectives[0].terminal = testing::f("exp(c)*w2 + 0*theta"), objectives[0].parameters_only = testing::f("w2^2*c");
  objectives[0].samples = {{0.3, testing::f("(w2 - t)^3")}};
  objectives[1].mean("rms_of") = testing::f("c*cos(t*w2/10) + 0.1");
  objectives[2].mean("maximum_of") = objectives[3].mean("minimum_of") = testing::f("c*sin(t*w2/10)*w2/20");
  objectives[2].sharpness = objectives[3].sharpness = 5;
  objectives[4].mean("maximum_of") = testing::f("100 + c*sin(t*w2/10)*w2"), objectives[4].sharpness = 60;
  objectives[5].mean("peak_to_peak_of") = testing::f("c*sin(t*w2/10)*w2/20"), objectives[5].sharpness = 5;
  Problem problem = swing();
  problem.scene.simulation.integrator.rtol = 1e-10, problem.scene.simulation.integrator.atol = 1e-12;
  problem.scene.simulation.integrator.max_step = 0.005;  // quadratures of both are exact to 1e-8 then
  problem.objectives = objectives;
  Evaluator evaluator(problem.scene, objectives_of(problem), {"w2", "c"});
  const Evaluation at = evaluator.gradients(evaluator.start());
  REQUIRE(at.ok);
  const Hessians H = gauss_newton(evaluator, at);
  REQUIRE(H.ok);
  const Hessians exact = hessians(evaluator, evaluator.start());
  REQUIRE(exact.ok);
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    INFO(objectives[i].name << '\n' << H.of[i].value << '\n' << exact.of[i].value);
    CHECK(largest(H.of[i].value - exact.of[i].value) < 1e-6 * largest(exact.of[i].value));
  }
}

TEST_CASE("five-bar: where it is held still Gauss-Newton is the exact Hessian, elsewhere it is not", "[gauss_newton]") {
  const bool at_optimum = GENERATE(true, false);
  Problem problem = five_bar::problem(at_optimum ? 1e-10 : 1e-7);
  if (at_optimum) {
    problem.scene.parameters[0].value = five_bar::kL01, problem.scene.parameters[1].value = five_bar::kL02;
  }
  problem.scene.simulation.integrator.max_step = 0.02;  // at rest steps would grow too long for what is beside it
  Evaluator evaluator(problem.scene, objectives_of(problem), {"L01", "L02"});
  const Evaluation at = evaluator.gradients(evaluator.start());
  const Hessians H = gauss_newton(evaluator, at);
  REQUIRE(H.ok);
  const Hessians exact = hessians(evaluator, evaluator.start());
  INFO(exact.message);
  REQUIRE(exact.ok);
  const double difference = largest(H.of[0].value - exact.of[0].value) / largest(H.of[0].value);
  INFO(difference << ", error of the exact one " << exact.of[0].relative());
  if (at_optimum)
    CHECK(difference < 1e-6);
  else
    CHECK(difference > 0.01);
  const double least = Eigen::SelfAdjointEigenSolver<MatrixXd>(H.of[0].value).eigenvalues()(0);
  CHECK(least > 0);
}

TEST_CASE("five-bar: a design by Gauss-Newton comes to the optimum", "[gauss_newton]") {
  Problem problem = five_bar::problem(1e-6);
  for (std::size_t k = 0; k < 2; ++k) problem.scene.parameters[k].lower = 1, problem.scene.parameters[k].upper = 3;
  problem.design.emplace();
  problem.design->minimize = "motion";
  problem.design->variables = {"L01", "L02"};
  problem.design->optimizer.hessian = "gauss_newton";
  const DesignResult result = run_design(problem);
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.variables[0].value == Approx(five_bar::kL01).margin(1e-6));
  CHECK(result.variables[1].value == Approx(five_bar::kL02).margin(1e-6));
  CHECK_THAT(result.algorithm, Contains("Gauss-Newton"));
  CHECK(result.iterations <= 5);
  WARN(result.iterations << " iterations, " << result.evaluations << " evaluations, " << result.simulations
                         << " simulations");
}

TEST_CASE("Gauss-Newton is refused where it says nothing, with the place", "[gauss_newton]") {
  Problem problem = five_bar::problem();
  ObjectiveSpec linear = named("linear"), square = named("square");
  linear.running = testing::f("t*r2_x"), linear.parameters_only = testing::f("3*L01");
  square.running = testing::f("r2_x^2");
  problem.objectives = {linear, square};
  problem.design.emplace();
  problem.design->minimize = "linear", problem.design->variables = {"L01"};
  problem.design->optimizer.hessian = "gauss_newton";
  CHECK_THROWS_WITH(run_design(problem), Contains("design.optimizer.hessian: ") && Contains("'linear' is linear"));
  const std::vector<SceneIssue> issues = find_issues(problem);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].path == "design.optimizer.hessian");
  problem.design->minimize = "square";
  CHECK(find_issues(problem).empty());
  problem.scene.simulation.integrator.type = "cvodes_bdf";
  for (const std::string hessian : {"gauss_newton", "exact"}) {
    problem.design->optimizer.hessian = hessian;
    CHECK_THROWS_WITH(run_design(problem),
                      Contains("design.optimizer.hessian: is '" + hessian) && Contains("cvodes_bdf"));
  }
}
