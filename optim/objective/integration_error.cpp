#include "optim/objective/integration_error.hpp"

namespace mbsopt {

std::optional<Scene> with_other_tolerances(Scene scene) {
  IntegratorSettings& given = scene.simulation.integrator;
  if (given.step) return std::nullopt;
  constexpr double kTightest = 1e-12;  // rounding starves the step-size control beyond
  const double factor = given.rtol > 10 * kTightest ? 0.1 : 10;
  given.rtol *= factor, given.atol *= factor;
  return scene;
}

IntegrationError integration_error(const Scene& scene, const std::vector<Objective>& objectives,
                                   const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                   const IntegrationErrorOptions& options) {
  IntegrationError error;
  error.psi.setZero(psi.size()), error.psi_rho.setZero(psi_rho.rows(), psi_rho.cols());
  std::optional<Scene> other = with_other_tolerances(scene);
  if (!other) return error;
  error.psi_rho = scene.simulation.integrator.rtol * psi_rho.cwiseAbs();
  Evaluator evaluator(*std::move(other), objectives, {}, {options.method, {}, options.user_forces, options.progress});
  const Evaluation& e = evaluator.gradients(evaluator.start());
  error.simulations = e.simulations;
  if (!e.ok) return error;
  error.psi = error.psi.cwiseMax((e.psi - psi).cwiseAbs());
  error.psi_rho = error.psi_rho.cwiseMax((e.psi_rho - psi_rho).cwiseAbs());
  return error;
}

}  // namespace mbsopt
