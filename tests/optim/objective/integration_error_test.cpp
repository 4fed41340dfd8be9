#include "optim/objective/integration_error.hpp"

#include <catch2/catch.hpp>

#include "optim/objective/evaluator.hpp"
#include "optim/objective/gradient_doubts.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;

TEST_CASE("five-bar: the estimated integration error is of the size of the true one", "[integration_error]") {
  const Problem problem = five_bar::problem(GENERATE(1e-5, 1e-7));
  Evaluator evaluator(problem.scene, objectives_of(problem));
  const Evaluation base = evaluator.gradients(evaluator.start());
  const IntegrationError error = integration_error(evaluator, base);
  CHECK(error.simulations == 1);
  CHECK(std::abs(base.psi(0) - five_bar::kPsi) < 3 * error.psi(0));
  CHECK(error.psi(0) < 1e-2 * five_bar::kPsi);
  for (Eigen::Index k = 0; k < 10; ++k) {
    const double exact = five_bar::kGradient[static_cast<std::size_t>(k)].second;
    CHECK(std::abs(base.psi_rho(0, k) - exact) < 10 * error.psi_rho(0, k));
  }
}

TEST_CASE("with fixed steps there is no error that jumps from run to run", "[integration_error]") {
  Problem problem = five_bar::problem(1e-5);
  problem.scene.simulation.integrator.step = 0.01;
  const Evaluator evaluator(problem.scene, objectives_of(problem));
  Evaluation base;
  base.psi.setOnes(1), base.psi_rho.setOnes(1, 10);
  const IntegrationError error = integration_error(evaluator, base);
  CHECK(error.psi(0) == 0);
  CHECK(error.psi_rho.norm() == 0);
  CHECK(error.simulations == 0);
}

namespace {

struct Gradients {
  Evaluator evaluator;
  Evaluation e = evaluator.gradients(evaluator.start());
  explicit Gradients(const Problem& problem) : evaluator(problem.scene, objectives_of(problem)) {}
};

// A body falls along a parabola, which dopri5 meets exactly: tolerances choose no steps, and an integral over them has
// the error of the longest ones.
Problem falling(const std::string& running) {
  Problem problem;
  Body body;
  body.name = "b", body.mass = 1.0, body.inertia = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  problem.scene.bodies.push_back(body);
  problem.scene.simulation.end_time = 1;
  problem.scene.simulation.integrator.type = "dopri5";
  problem.scene.simulation.integrator.rtol = problem.scene.simulation.integrator.atol = 1e-8;
  Parameter p;
  p.name = "p", p.value = 1;
  problem.scene.parameters.push_back(p);
  ObjectiveSpec objective;
  objective.name = "J", objective.running = Expression::parse(running);
  problem.objectives.push_back(objective);
  return problem;
}

}  // namespace

// The integral of exp(-((t - 0.5)/w)^2) from 0 to 1 is w sqrt(pi) erf(1/(2w)).
TEST_CASE("integrals of a motion that any steps meet have an error that shows", "[integration_error]") {
  const Problem problem = falling("p*exp(-((t - 0.5)/0.3)^2)");
  const auto [evaluator, e] = Gradients(problem);
  INFO(e.message);
  REQUIRE(e.ok);
  const double exact = 0.3 * std::sqrt(std::acos(-1.0)) * std::erf(0.5 / 0.3), off = std::abs(e.psi_rho(0, 0) - exact);
  INFO(e.statistics.steps << " steps, off by " << off);
  CHECK(off > 1e-4 * exact);
  CHECK(may_be_unresolved(evaluator, e));
  const IntegrationError error = integration_error(evaluator, e);
  CHECK(error.psi_rho(0, 0) > 0.3 * off);
  CHECK(unresolved_gradients(evaluator, e, error).size() == 1);
}

// The integral of L01 exp(-((t - 0.5)/w)^2) over the real axis is L01 w sqrt(pi).
TEST_CASE("a gradient that the steps do not resolve is doubted, one that they resolve is not", "[integration_error]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.end_time = 1;
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  if (GENERATE(false, true)) {
    problem.scene.simulation.integrator.step = 0.01;
  } else {
    problem.scene.simulation.integrator.max_step = 0.01;
  }
  const double width = GENERATE(1e-3, 0.1);
  problem.objectives[0].running = Expression::parse("L01*exp(-((t - 0.5)/" + std::to_string(width) + ")^2)");
  const auto [evaluator, e] = Gradients(problem);
  REQUIRE(e.ok);
  const double exact = width * std::sqrt(std::acos(-1.0));
  const std::vector<std::string> found = gradient_doubts(evaluator, e);
  INFO("width " << width << ": off by " << e.psi_rho(0, 0) / exact - 1);
  CHECK((std::abs(e.psi_rho(0, 0) - exact) > 1e-4 * exact) == (width < 0.01));
  CHECK(may_be_unresolved(evaluator, e) == (width < 0.01));
  REQUIRE(found.size() == (width < 0.01 ? 1U : 0U));
  if (width < 0.01) CHECK(found[0].find("gradient of objective 'motion'") != std::string::npos);
}

TEST_CASE("a motion that magnifies what changes at its start asks for an estimate", "[integration_error]") {
  const Problem problem = five_bar::problem(1e-8);
  auto [evaluator, e] = Gradients(problem);
  CHECK_FALSE(may_be_unresolved(evaluator, e));
  e.psi_rho *= 1e6;
  CHECK(may_be_unresolved(evaluator, e));
}

TEST_CASE("an rms that is hardly larger than the tolerances asks for an estimate", "[integration_error]") {
  Problem problem = five_bar::problem(1e-8);
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  const bool small = GENERATE(false, true);
  problem.objectives[0].running.reset();
  problem.objectives[0].mean("rms_of") = Expression::parse(small ? "1e-9*L01" : "L01");
  const auto [evaluator, e] = Gradients(problem);
  CHECK(may_be_unresolved(evaluator, e) == small);
}

TEST_CASE("a tenth of the errors: rtol by 10, a largest step by 10^(1/order)", "[integration_error]") {
  Problem problem = five_bar::problem(1e-5);
  problem.scene.simulation.integrator.max_step = 0.1;
  const IntegratorSettings s = with_errors_times(0.1, problem.scene).simulation.integrator;  // dopri5
  CHECK(s.rtol == Approx(1e-6));
  CHECK(*s.max_step == Approx(0.1 * std::pow(0.1, 0.2)));
  CHECK(with_other_tolerances(problem.scene)->simulation.integrator.max_step == s.max_step);
}
