// The five-bar end to end: value, ten derivatives, design.
#include "five_bar.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "optim/design/design.hpp"
#include "optim/objective/evaluator.hpp"

using namespace mbsopt;

TEST_CASE("five-bar: psi and its ten derivatives match the reference, by TLM and adjoint alike", "[five_bar]") {
  const Problem problem = five_bar::problem(1e-10);
  EvaluatorOptions options;
  options.method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint);
  INFO(to_string(options.method));
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  const Evaluation& e = evaluator.gradients(evaluator.start());
  INFO(e.message);
  REQUIRE(e.ok);
  CHECK(e.method == options.method);
  CHECK(e.psi(0) == Approx(five_bar::kPsi).epsilon(1e-8));
  for (Eigen::Index k = 0; k < 10; ++k) {
    const auto& [name, reference] = five_bar::kGradient[static_cast<std::size_t>(k)];
    INFO(name << " relative error " << e.psi_rho(0, k) / reference - 1);
    CHECK(e.psi_rho(0, k) == Approx(reference).epsilon(1e-8));
  }
}

TEST_CASE("five-bar: the evaluator computes a point once, and only the derivatives that are wanted", "[five_bar]") {
  const Problem problem = five_bar::problem(1e-8);
  Evaluator evaluator(problem.scene, objectives_of(problem), {"m3", "L02"});
  const Evaluation first = evaluator.gradients(evaluator.start());
  REQUIRE(first.ok);
  CHECK(first.psi_rho.cols() == 2);
  CHECK(first.psi_rho(0, 0) == Approx(five_bar::kGradient[8].second).epsilon(1e-5));
  CHECK(first.psi_rho(0, 1) == Approx(five_bar::kGradient[1].second).epsilon(1e-5));
  CHECK(first.method == GradientMethod::adjoint);  // one objective
  CHECK(first.choice.find("2 variables, 1 objective;") != std::string::npos);
  evaluator.values(evaluator.start());
  evaluator.gradients(evaluator.start());
  CHECK(evaluator.simulations() == 1);
}

TEST_CASE("many objectives of few variables are differentiated forward, few of many backward", "[five_bar]") {
  CHECK(gradient_cost(2, 10).tlm < gradient_cost(2, 10).adjoint);
  CHECK(gradient_cost(20, 1).adjoint < gradient_cost(20, 1).tlm);
}

TEST_CASE("five-bar: differences agree with the reference on frozen and on free steps", "[five_bar]") {
  const Problem problem = five_bar::problem(1e-10);
  EvaluatorOptions options;
  options.method = GradientMethod::differences;
  options.differences.frozen_steps = GENERATE(true, false);
  Evaluator evaluator(problem.scene, objectives_of(problem), {"L01", "c1", "m2"}, options);
  const Evaluation& e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  CHECK(e.psi_rho(0, 0) == Approx(0.43585125087835).epsilon(1e-7));
  CHECK(e.psi_rho(0, 1) == Approx(-0.040992678495154).epsilon(1e-7));
  CHECK(e.psi_rho(0, 2) == Approx(0.059162921408138).epsilon(1e-7));
  CHECK(e.simulations == 1 + 3 * 8);
}

TEST_CASE("five-bar: the design holds the mechanism still, from the given lengths and default tolerances",
          "[five_bar]") {
  Problem problem = five_bar::problem();
  problem.scene.simulation.integrator = IntegratorSettings();
  problem.design.emplace();
  problem.design->minimize = "motion";
  problem.design->variables = {"L01", "L02"};
  if (GENERATE(false, true)) {
    for (int k = 0; k < 2; ++k)
      problem.scene.parameters[static_cast<std::size_t>(k)].lower = 0.5,
      problem.scene.parameters[static_cast<std::size_t>(k)].upper = 4;
  }
  const DesignResult result = run_design(problem);
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.variables[0].value == Approx(five_bar::kL01).margin(1e-6));
  CHECK(result.variables[1].value == Approx(five_bar::kL02).margin(1e-6));
  CHECK(result.objective_final < 1e-10);
  CHECK(result.objective_initial == Approx(five_bar::kPsi).epsilon(1e-3));
  CHECK(result.variables[0].initial == std::sqrt(5));
  CHECK(result.history.size() == static_cast<std::size_t>(result.iterations) + 1);
  CHECK(result.history.front().objective == result.objective_initial);
  WARN(result.iterations << " iterations, " << result.evaluations << " evaluations, psi " << result.objective_final
                         << ", L01 - L01* " << result.variables[0].value - five_bar::kL01 << ", L02 - L02* "
                         << result.variables[1].value - five_bar::kL02 << ", " << result.wall_seconds << " s");
}

TEST_CASE("five-bar: a bound on another objective is held, and said to be touched", "[five_bar]") {
  Problem problem = five_bar::problem(1e-8);
  ObjectiveSpec total;
  total.name = "total_length";
  total.parameters_only = Expression::parse("L01 + L02");
  problem.objectives.push_back(total);
  problem.design.emplace();
  problem.design->minimize = "motion";
  problem.design->variables = {"L01", "L02"};
  problem.design->subject_to = {{"total_length", 4.1, {}}};  // the free optimum has 4.065
  const DesignResult result = run_design(problem);
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  REQUIRE(result.constraints.size() == 1);
  CHECK(result.constraints[0].value == Approx(4.1).margin(1e-6));
  CHECK(result.constraints[0].violation < 1e-7);
  CHECK(result.constraints[0].at_lower);
  CHECK(result.objective_final > 1e-6);
  // Lagrange: along the constraint the objective does not fall any more.
  const Eigen::MatrixXd& g = result.final_evaluation.psi_rho;
  CHECK(std::abs(g(0, 0) - g(0, 1)) < 1e-3 * std::abs(g(0, 0)));
}

TEST_CASE("a design that makes no sense is refused with the place", "[five_bar]") {
  using Catch::Matchers::Contains;
  Problem problem = five_bar::problem(1e-6);
  CHECK_THROWS_WITH(run_design(problem), Contains("design: is missing"));
  problem.design.emplace();
  problem.design->minimize = "motion";
  CHECK_THROWS_WITH(run_design(problem), Contains("design.variables: is empty"));
  problem.design->variables = {"L1"};
  CHECK_THROWS_WITH(run_design(problem), Contains("no parameter 'L1'") && Contains("did you mean 'L01'"));
  problem.design->variables = {"L01"};
  problem.design->minimize = "motoin";
  CHECK_THROWS_WITH(run_design(problem), Contains("no objective 'motoin'") && Contains("did you mean 'motion'"));
  problem.design->minimize = "motion";
  problem.design->subject_to = {{"motion", {}, {}}};
  CHECK_THROWS_WITH(run_design(problem), Contains("design.subject_to[0]: gives neither"));
}

TEST_CASE("a design that is stopped keeps the best point it has seen", "[five_bar]") {
  Problem problem = five_bar::problem(1e-6);
  problem.design.emplace();
  problem.design->minimize = "motion";
  problem.design->variables = {"L01", "L02"};
  DesignOptions options;
  options.compare_differences = false;  // the search itself is stopped, not what precedes it
  SECTION("between iterations") {
    options.progress = [](const DesignRow& row) { return row.iteration < 2; };
  }
  SECTION("within a simulation") {
    int simulations = 0;
    double last = 1e9;
    options.simulation_progress = [=](double t) mutable {
      simulations += t < last;
      last = t;
      return simulations < 5;
    };
  }
  const DesignResult result = run_design(problem, options);
  CHECK(result.status == SolverStatus::stopped);
  CHECK(result.objective_final < 0.9 * result.objective_initial);
  CHECK(result.variables[0].value != result.variables[0].initial);
  CHECK(result.rho(0) == result.variables[0].value);
}
