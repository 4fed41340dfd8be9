#include "optim/integration_error.hpp"

namespace mbsopt {

IntegrationError integration_error(const Scene& scene, const std::vector<Objective>& objectives,
                                   const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                   const IntegrationErrorOptions& options) {
  IntegrationError error;
  error.psi.setZero(psi.size()), error.psi_rho.setZero(psi_rho.rows(), psi_rho.cols());
  const IntegratorSettings& given = scene.simulation.integrator;
  if (given.step) return error;
  error.psi_rho = given.rtol * psi_rho.cwiseAbs();

  constexpr double kTightest = 1e-12;  // rounding starves the step-size control beyond
  const double factor = given.rtol > 10 * kTightest ? 0.1 : 10;
  Scene other = scene;
  other.simulation.integrator.rtol *= factor, other.simulation.integrator.atol *= factor;
  Evaluator evaluator(std::move(other), objectives, {}, {options.method, {}, options.user_forces, options.progress});
  const Evaluation& e = evaluator.gradients(evaluator.start());
  error.simulations = e.simulations;
  if (!e.ok) return error;
  error.psi = error.psi.cwiseMax((e.psi - psi).cwiseAbs());
  error.psi_rho = error.psi_rho.cwiseMax((e.psi_rho - psi_rho).cwiseAbs());
  return error;
}

}  // namespace mbsopt
