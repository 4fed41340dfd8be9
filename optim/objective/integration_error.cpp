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

}  // namespace

Scene with_errors_times(double factor, Scene scene, long steps) {
  IntegratorSettings& s = scene.simulation.integrator;
  s.rtol *= factor;
  s.atol *= factor;
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

IntegrationError integration_error(const Evaluator& evaluator, const Evaluation& at, GradientMethod method) {
  IntegrationError error{Eigen::VectorXd::Zero(at.psi.size()),
                         Eigen::MatrixXd::Zero(at.psi_rho.rows(), at.psi_rho.cols())};
  const std::optional<Scene> scene = with_other_tolerances(evaluator.scene(), at.statistics.steps);
  if (!scene) return error;
  error.psi_rho = evaluator.scene().simulation.integrator.rtol * at.psi_rho.cwiseAbs();
  const Evaluation e = evaluator.in(*scene, method).gradients(at.rho);
  error.simulations = e.simulations;
  if (!e.ok) return error;
  error.psi = (e.psi - at.psi).cwiseAbs();
  error.psi_rho = error.psi_rho.cwiseMax((e.psi_rho - at.psi_rho).cwiseAbs());
  return error;
}

bool may_be_unresolved(const Evaluator& evaluator, const Evaluation& e) {
  constexpr double kPessimistic = 2;  // estimates of integrals are at least so many times their errors
  constexpr double kDrift = 0.1;      // derivatives of a motion that leaves the constraints are off by more than it is
  const SimulationStatistics& s = e.statistics;
  if (std::max({s.quadrature.error, s.extreme_quadrature.error, s.gradient_quadrature.error}) >
      kPessimistic * kResolved)
    return true;
  const IntegratorSettings& given = evaluator.scene().simulation.integrator;
  if (given.step) return false;
  if (s.relative_position_violation > kDrift * kResolved) return true;
  const std::vector<Objective>& objectives = evaluator.objectives();
  for (std::size_t i = 0; i < objectives.size(); ++i)
    if (objectives[i].mean() && !objectives[i].is_extreme() &&
        given.rtol + given.atol > kResolved * e.psi(static_cast<Eigen::Index>(i)))
      return true;
  const Eigen::VectorXd changes = e.psi_rho.cwiseAbs() * evaluator.sizes(e.rho);
  return (given.rtol * changes.array() > kResolved * e.psi.array().abs()).any();
}

std::vector<std::string> unresolved_gradients(const Evaluator& evaluator, const Evaluation& at,
                                              const IntegrationError& error) {
  constexpr double kNothing = 1e-3;  // of psi: a gradient below it is compared with it, as `check` does
  const IntegratorSettings& given = evaluator.scene().simulation.integrator;
  const Eigen::VectorXd sizes = evaluator.sizes(at.rho);
  const Eigen::MatrixXd sized = at.psi_rho.cwiseAbs() * sizes.asDiagonal(),
                        errors = error.psi_rho.cwiseAbs() * sizes.asDiagonal();
  std::vector<std::string> sentences;
  for (Eigen::Index i = 0; i < at.psi.size() && sizes.size() > 0; ++i) {
    Eigen::Index k = 0;
    const double worst = errors.row(i).maxCoeff(&k);
    const double size = std::max(sized.row(i).maxCoeff(), kNothing * std::abs(at.psi(i)));
    // An objective of the size of atol is zero to the integrator, and its gradient rounding.
    if (size == 0 || !(worst > kResolved * std::max(size, given.atol))) continue;
    sentences.push_back(fmt::format(
        "the steps do not resolve the gradient of objective '{}': another run with {} the integration errors "
        "changes its entry of '{}' by {:.2g}, {:.2g} % of the largest. {}",
        evaluator.objectives()[static_cast<std::size_t>(i)].name(),
        given.step || other_errors(given) < 1 ? "a tenth of" : "ten times", evaluator.variable(k).name,
        error.psi_rho(i, k), 100 * worst / size,
        given.step ? "Take a smaller simulation.integrator.step"
                   : "Set simulation.integrator.max_step or tighten rtol and atol; where that changes nothing, the "
                     "motion magnifies errors, and a shorter run helps"));
  }
  return sentences;
}

}  // namespace mbsopt::inline optim
