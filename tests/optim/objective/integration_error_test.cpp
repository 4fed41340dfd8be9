#include "optim/objective/integration_error.hpp"

#include <catch2/catch.hpp>

#include "optim/objective/evaluator.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;

TEST_CASE("five-bar: the estimated integration error is of the size of the true one", "[integration_error]") {
  const Problem problem = five_bar::problem(GENERATE(1e-5, 1e-7));
  const std::vector<Objective> objectives = objectives_of(problem);
  Evaluator evaluator(problem.scene, objectives);
  const Evaluation& base = evaluator.gradients(evaluator.start());
  const IntegrationError error = integration_error(problem.scene, objectives, base.psi, base.psi_rho);
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
  const IntegrationError error =
      integration_error(problem.scene, objectives_of(problem), Eigen::VectorXd::Ones(1), Eigen::MatrixXd::Ones(1, 10));
  CHECK(error.psi(0) == 0);
  CHECK(error.psi_rho.norm() == 0);
  CHECK(error.simulations == 0);
}
