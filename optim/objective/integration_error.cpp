#include "optim/objective/integration_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/tableau/tableaus.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kTightest = 1e-12;  // rounding starves the step-size control beyond
constexpr double kResolved = 1e-4;   // of a gradient: less affects no optimiser's step and no fit's interval

double other_errors(const IntegratorSettings& given) { return given.rtol > 10 * kTightest ? 0.1 : 10; }

// |psi_rho| times the parameters' sizes.
Eigen::MatrixXd contributions(const Scene& scene, const Eigen::MatrixXd& psi_rho) {
  Eigen::MatrixXd sized = psi_rho.cwiseAbs();
  for (Eigen::Index k = 0; k < sized.cols(); ++k) {
    const Parameter& p = scene.parameters[static_cast<std::size_t>(k)];
    sized.col(k) *= typical_size(p, p.value);
  }
  return sized;
}

}  // namespace

Scene with_errors_times(double factor, Scene scene, long steps) {
  IntegratorSettings& s = scene.simulation.integrator;
  s.rtol *= factor, s.atol *= factor;
  if (const Method* method = runge_kutta_method(s.type)) {
    const double ratio = std::pow(factor, 1.0 / method->order);
    if (s.max_step) *s.max_step *= ratio;
    if (steps > 0 && factor < 1 && !s.step) {
      const double span = scene.simulation.end_time - scene.simulation.start_time;
      s.max_step = std::min(s.max_step.value_or(span), ratio * span / static_cast<double>(steps));
    }
    if (s.step) *s.step *= ratio;
  }
  return scene;
}

std::optional<Scene> with_other_tolerances(Scene scene, long steps) {
  const IntegratorSettings& given = scene.simulation.integrator;
  if (given.step) return std::nullopt;
  const double factor = other_errors(given);
  return with_errors_times(factor, std::move(scene), steps);
}

IntegrationError integration_error(const Scene& scene, const std::vector<Objective>& objectives,
                                   const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                   const IntegrationErrorOptions& options) {
  IntegrationError error;
  error.psi.setZero(psi.size()), error.psi_rho.setZero(psi_rho.rows(), psi_rho.cols());
  const IntegratorSettings& given = scene.simulation.integrator;
  if (given.step && !options.fixed_steps) return error;
  if (!given.step) error.psi_rho = given.rtol * psi_rho.cwiseAbs();
  Evaluator evaluator(with_errors_times(given.step ? 0.1 : other_errors(given), scene, options.steps), objectives, {},
                      {options.method, {}, options.user_forces, options.progress});
  const Evaluation& e = evaluator.gradients(evaluator.start());
  error.simulations = e.simulations;
  if (!e.ok) return error;
  error.psi = error.psi.cwiseMax((e.psi - psi).cwiseAbs());
  error.psi_rho = error.psi_rho.cwiseMax((e.psi_rho - psi_rho).cwiseAbs());
  return error;
}

bool may_be_unresolved(const Scene& scene, const std::vector<Objective>& objectives, const Evaluation& e) {
  constexpr double kDrift = 0.1;  // derivatives of a motion that leaves the constraints are off by more than it is
  const SimulationStatistics& s = e.statistics;
  if (std::max({s.quadrature.error, s.extreme_quadrature.error, s.gradient_quadrature.error}) > kResolved) return true;
  const IntegratorSettings& given = scene.simulation.integrator;
  if (given.step) return false;
  if (s.relative_position_violation > kDrift * kResolved) return true;
  for (std::size_t i = 0; i < objectives.size(); ++i)
    if (objectives[i].mean() && !objectives[i].is_extreme() &&
        given.rtol + given.atol > kResolved * e.psi(static_cast<Eigen::Index>(i)))
      return true;
  const Eigen::VectorXd changes = contributions(scene, e.psi_rho).rowwise().sum();
  return (given.rtol * changes.array() > kResolved * e.psi.array().abs()).any();
}

std::vector<std::string> unresolved_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                                              const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                              const IntegrationError& error) {
  constexpr double kNothing = 1e-3;  // of psi: a gradient below it is compared with it, as `check` does
  const Eigen::MatrixXd sized = contributions(scene, psi_rho), errors = contributions(scene, error.psi_rho);
  std::vector<std::string> sentences;
  for (Eigen::Index i = 0; i < psi.size() && psi_rho.cols() > 0; ++i) {
    Eigen::Index k = 0;
    const double worst = errors.row(i).maxCoeff(&k);
    const double size = std::max(sized.row(i).maxCoeff(), kNothing * std::abs(psi(i)));
    // An objective of the size of atol is zero to the integrator, and its gradient rounding.
    if (size == 0 || !(worst > kResolved * std::max(size, scene.simulation.integrator.atol))) continue;
    sentences.push_back(fmt::format(
        "the steps do not resolve the gradient of objective '{}': another run with {} the integration errors "
        "changes its entry of '{}' by {:.2g}, {:.2g} % of the largest. {}",
        objectives[static_cast<std::size_t>(i)].name(),
        scene.simulation.integrator.step || other_errors(scene.simulation.integrator) < 1 ? "a tenth of" : "ten times",
        scene.parameters[static_cast<std::size_t>(k)].name, error.psi_rho(i, k), 100 * worst / size,
        scene.simulation.integrator.step ? "Take a smaller simulation.integrator.step"
                                         : "Set simulation.integrator.max_step or tighten rtol and atol; where that "
                                           "changes nothing, the motion magnifies errors, and a shorter run helps"));
  }
  return sentences;
}

}  // namespace mbsopt::inline optim
