// Gradients by CVODES through the evaluator, and the check that sets them beside the discrete ones.
#include "optim/check/continuous_check.hpp"

#include <catch2/catch.hpp>

#include "optim/check/gradient_check.hpp"
#include "optim/objective/evaluator.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

Evaluation evaluated(const Problem& problem, GradientMethod method) {
  EvaluatorOptions options;
  options.method = method;
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  return evaluator.gradients(evaluator.start());
}

ObjectiveSpec sum(const std::string& name, const std::string& running) {
  ObjectiveSpec spec;
  spec.name = name;
  spec.running = Expression::parse(running);
  return spec;
}

}  // namespace

TEST_CASE("five-bar by CVODES: the reference's derivatives to 1e-6 at rtol 1e-9", "[cvodes]") {
  Problem problem = five_bar::problem(1e-9);
  problem.scene.simulation.integrator.type = GENERATE(as<std::string>{}, "dopri5", "cvodes_adams", "cvodes_bdf");
  const GradientMethod method = GENERATE(GradientMethod::cvodes_forward, GradientMethod::cvodes_adjoint);
  const Evaluation e = evaluated(problem, method);
  INFO(problem.scene.simulation.integrator.type << ", " << to_string(method) << ": " << e.message);
  REQUIRE(e.ok);
  CHECK(e.method == method);
  CHECK(e.choice.empty() == (problem.scene.simulation.integrator.type != "dopri5"));
  CHECK(e.psi(0) == Approx(five_bar::kPsi).epsilon(1e-6));
  double largest = 0;
  for (const auto& [name, derivative] : five_bar::kGradient) largest = std::max(largest, std::abs(derivative));
  Eigen::Index k = 0;
  for (const auto& [name, derivative] : five_bar::kGradient) {
    INFO(name);
    CHECK(std::abs(e.psi_rho(0, k++) - derivative) < 1e-6 * std::max(std::abs(derivative), 1e-3 * largest));
  }
}

TEST_CASE("a scene of CVODES: its own methods stand for auto, tlm and adjoint, and it says so", "[cvodes]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.integrator.type = "cvodes_adams";
  problem.scene.simulation.end_time = 1;
  const Evaluation automatic = evaluated(problem, GradientMethod::automatic),
                   tlm = evaluated(problem, GradientMethod::tlm), adjoint = evaluated(problem, GradientMethod::adjoint),
                   differences = evaluated(problem, GradientMethod::differences);
  REQUIRE((automatic.ok && tlm.ok && adjoint.ok && differences.ok));
  CHECK(automatic.method == GradientMethod::cvodes_adjoint);
  CHECK_THAT(automatic.choice, Contains("cvodes_adjoint"));
  CHECK(tlm.method == GradientMethod::cvodes_forward);
  CHECK_THAT(tlm.choice, Contains("no discrete derivatives"));
  CHECK(adjoint.method == GradientMethod::cvodes_adjoint);
  CHECK(automatic.psi_rho == adjoint.psi_rho);
  const double size = tlm.psi_rho.cwiseAbs().maxCoeff();
  CHECK((tlm.psi_rho - adjoint.psi_rho).cwiseAbs().maxCoeff() < 1e-6 * size);
  CHECK((tlm.psi_rho - differences.psi_rho).cwiseAbs().maxCoeff() < 1e-4 * size);
}

TEST_CASE("smooth maxima, root mean squares and their true values by CVODES", "[cvodes]") {
  Problem problem = five_bar::problem(1e-9);
  problem.scene.simulation.end_time = 1;
  ObjectiveSpec highest, rms;
  highest.name = "highest", highest.mean("maximum_of") = Expression::parse("-r2_y"), highest.sharpness = 400.0;
  rms.name = "rms", rms.mean("rms_of") = Expression::parse("r2_x");
  problem.objectives = {highest, rms};
  const Evaluation discrete = evaluated(problem, GradientMethod::tlm);
  problem.scene.simulation.integrator.type = "cvodes_adams";
  Evaluator evaluator(problem.scene, objectives_of(problem));
  const Evaluation continuous = evaluator.gradients(evaluator.start());
  INFO(discrete.message << continuous.message);
  REQUIRE((discrete.ok && continuous.ok));
  for (Eigen::Index o = 0; o < 2; ++o) {
    CHECK(continuous.psi(o) == Approx(discrete.psi(o)).epsilon(1e-6));
    CHECK((continuous.psi_rho.row(o) - discrete.psi_rho.row(o)).norm() < 1e-5 * discrete.psi_rho.row(o).norm());
  }
  const std::vector<std::optional<double>> extremes = evaluator.true_values(evaluator.start());
  REQUIRE(extremes[0]);
  CHECK(*extremes[0] >= continuous.psi(0));
  CHECK(*extremes[0] < continuous.psi(0) + 0.05);
}

TEST_CASE("CVODES and the discrete derivatives agree to 1e-6, whatever the file's tolerances and steps", "[check]") {
  Problem problem = five_bar::problem(1e-4);
  problem.scene.simulation.end_time = 2;
  ObjectiveSpec drop;
  drop.name = "drop", drop.terminal = Expression::parse("r2_y");
  drop.samples = {{0.5, Expression::parse("r2_x*m2")}, {1.25, Expression::parse("t*r2_y^2")}};
  problem.objectives.push_back(drop);
  const bool fixed = GENERATE(false, true);
  if (fixed) problem.scene.simulation.integrator.type = "rk4", problem.scene.simulation.integrator.step = 0.01;
  const ContinuousCheck check = check_continuous(Evaluator(problem.scene, objectives_of(problem)));
  INFO(check.message);
  REQUIRE(check.ran);
  CHECK(check.entries.size() == 20);
  CHECK(check.rtol <= 1e-9);
  CHECK(check.discrete == (fixed ? "dopri853" : "dopri5"));
  CHECK(check.integrator == "cvodes_adams");
  for (const ContinuousEntry& e : check.entries) {
    INFO(e.objective << ", " << e.parameter << ": " << e.discrete << ", " << e.continuous);
    CHECK(e.verdict == Verdict::agrees);
  }
  CHECK(check.worst_difference("drop") < 1e-6);
  CHECK(check.worst_verdict("drop") == Verdict::agrees);
  CHECK(check.passed());
}

TEST_CASE("an integral that the discrete steps do not resolve is excused, and seen", "[check]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 1;
  problem.objectives = {sum("edge", "smooth_abs(r2_x, 1e-5)")};
  const ContinuousCheck check = check_continuous(Evaluator(problem.scene, objectives_of(problem)));
  INFO(check.message);
  REQUIRE(check.ran);
  CHECK(check.worst_difference("edge") > 1e-6);
  CHECK(check.worst_verdict("edge") == Verdict::buried);
  CHECK(check.passed());
}

TEST_CASE("where CVODES does not get through, nothing is judged, and it is said", "[check]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.integrator.max_steps = 20;
  const ContinuousCheck check = check_continuous(Evaluator(problem.scene, objectives_of(problem)));
  CHECK_FALSE(check.ran);
  CHECK(check.passed());
  CHECK_THAT(check.message, Contains("cvodes_adams") && Contains("cvodes_bdf") && Contains("20 steps"));
}

TEST_CASE("the gradient check of a scene of CVODES judges what it can", "[check]") {
  Problem problem = five_bar::problem(1e-7);
  problem.scene.simulation.integrator.type = "cvodes_adams";
  problem.scene.simulation.end_time = 1;
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem, options);
  INFO(check.message);
  REQUIRE(check.ran);
  CHECK_FALSE(check.discrete);
  for (const CheckedEntry& e : check.entries) {
    INFO(e.parameter << ": " << e.tlm << ", " << e.adjoint << ", " << e.free << " +- " << e.free_error);
    CHECK(passes(e.exact));
    CHECK_FALSE(e.frozen_verdict);
    REQUIRE(e.free_verdict);
    CHECK(passes(*e.free_verdict));
  }
  CHECK(check.identities.empty());
  CHECK(check.taylor.empty());
  REQUIRE(check.continuous);
  CHECK(check.continuous->discrete == "dopri853");
  CHECK(check.passed());
}

TEST_CASE("a verdict weighs the difference against the threshold, then against the error", "[check]") {
  CHECK(verdict_of(1 + 1e-7, 0, 1, 1, 1e-6) == Verdict::agrees);
  CHECK(verdict_of(1 + 1e-5, 0, 1, 1, 1e-6) == Verdict::disagrees);
  CHECK(verdict_of(1 + 1e-5, 1e-5, 1, 1, 1e-6) == Verdict::buried);
  CHECK(verdict_of(1 + 1e-5, 1e-7, 1, 1, 1e-6) == Verdict::disagrees);
  CHECK(verdict_of(std::nan(""), 1, 1, 1, 1e-6) == Verdict::failed);
  CHECK(verdict_of(0, 0, 0, 0, 1e-6) == Verdict::zero);
}

// alpha 1e4 leaves accelerations off by about 1e-4, which projection takes out and CVODES does not: two motions.
TEST_CASE("derivatives of penalty are compared with CVODES without projection", "[check]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.end_time = 1;
  FormulationSettings& formulation = problem.scene.simulation.formulation;
  formulation.type = FormulationType::penalty, formulation.linear_solver = LinearSolver::quasidefinite;
  formulation.alpha = 1e4;
  REQUIRE(formulation.projection == Projection::position_velocity);
  const ContinuousCheck check = check_continuous(Evaluator(problem.scene, objectives_of(problem)));
  INFO(check.message);
  REQUIRE(check.ran);
  INFO(check.worst_difference("motion"));
  CHECK(check.worst_verdict("motion") == Verdict::agrees);
}
