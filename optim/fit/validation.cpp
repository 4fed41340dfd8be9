#include "optim/fit/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/linear/dense.hpp"
#include "optim/fit/distributions.hpp"
#include "optim/fit/fit_assessment.hpp"
#include "optim/fit/fit_search.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kWorse = 0.99;  // probability that a right model worsens what validates by less

// Has no residuals if nothing could be simulated.
LeastSquaresResult refitted(const FitContext& fit, ExperimentStack& stack) {
  LeastSquaresResult found;
  if (stack.unknowns().empty()) {
    found.point = stack.at(found.x);
    found.message = found.point.ok ? "simulated" : "could not be simulated: " + found.point.message;
    if (!found.point.ok) found.point.z.resize(0);
  } else {
    found = refit(fit, stack);
    found.message = "refitted, " + found.message;
  }
  return found;
}

// dz/drho of an experiment that validates, in its own parameters f and in the shared ones s. The refit compensates
// errors of s as far as it can:
//   f_s = -J_f^+ J_s,   j = j_s + j_f f_s
struct Sensitivities {
  Eigen::MatrixXd J_f, J, f_s;  // J: of s, with the refit
  Eigen::MatrixXd of_shared;    // the covariance of s
};

// There are none if the fit has no standard errors, or if the simulation fails.
std::optional<Sensitivities> sensitivities(FitContext& fit, std::size_t e, const ExperimentStack& stack,
                                           const LeastSquaresResult& found) {
  if (!fit.result.statistics.none.empty()) return std::nullopt;
  std::vector<UnknownParameter> all = stack.unknowns();  // with their values; then the shared ones
  const Eigen::Index F = std::ssize(all), N = stack.samples();
  const Eigen::VectorXd own = stack.scaling().to_rho(found.x);
  for (Eigen::Index k = 0; k < F; ++k) all[static_cast<std::size_t>(k)].description.value = own(k);
  const std::vector<UnknownParameter> fitted = unknowns_of_fit(fit.scene, fit.spec);
  std::vector<Eigen::Index> shared;
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    if (!fitted[i].shared) continue;
    shared.push_back(static_cast<Eigen::Index>(i)), all.push_back(fitted[i]);
    all.back().description.value = fit.shared(fitted[i].parameter);
  }
  ExperimentStack whole = stack_of(fit, {e}, fit.shared, std::move(all));
  const Eigen::VectorXd x = whole.start();
  const LeastSquaresPoint point = whole.at(x);
  fit.result.simulations += whole.simulations();
  if (!point.ok) return std::nullopt;
  const Eigen::MatrixXd J = whole.z_rho(point, x).topRows(N);
  Sensitivities s{J.leftCols(F), J.rightCols(J.cols() - F), {}, fit.result.statistics.covariance(shared, shared)};
  if (F == 0) return s;
  s.f_s = -OrthogonalDecomposition(s.J_f).solve(s.J);
  s.J += s.J_f * s.f_s;
  return s;
}

// cov(f) = own + f_s cov(s) f_s': the refit takes s as exact, which they are not.
void add_shared_errors(FitStatistics& own, const Eigen::VectorXd& values, const Sensitivities& s, double quantile) {
  const Eigen::MatrixXd added = s.f_s * s.of_shared * s.f_s.transpose();
  own.quantile = std::max(own.quantile, quantile);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    own.std_error(k) = std::hypot(own.std_error(k), std::sqrt(added(k, k)));
    const double half = own.quantile * own.std_error(k);
    own.ci95.row(k) << values(k) - half, values(k) + half;
  }
}

// variance = j cov(s) j' + j_f own j_f'
void predict_validation(FitContext& fit, const ExperimentStack& stack, const Sensitivities& s, const FitStatistics& own,
                        std::size_t first) {
  const Eigen::Index F = s.J_f.cols(), S = s.J.cols();
  Eigen::MatrixXd J(s.J.rows(), F + S);
  J << s.J_f, s.J;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(F + S, F + S);
  if (F > 0) covariance.topLeftCorner(F, F) = own.covariance;
  covariance.bottomRightCorner(S, S) = s.of_shared;
  predict(fit, stack, J, covariance, first);
}

// Warns if the fit has learnt something wrong. A right model that starts at the true values raises the squares of what
// validates by about chi^2 of its P parameters, for as many samples as are fitted. Correlated residuals raise them
// more.
void compare_with_start(FitContext& fit, std::size_t e, double squares) {
  const FitStatistics& s = fit.result.statistics;
  ExperimentStack before = stack_of(fit, {e}, parameter_values(fit.scene), free_in(fit.scene, fit.spec, e));
  const LeastSquaresResult start = refitted(fit, before);
  fit.result.simulations += before.simulations();
  if (start.point.z.size() == 0 || fit.abandoned) return;
  const double n = static_cast<double>(before.samples());
  const double squares_at_start = start.point.z.head(before.samples()).squaredNorm();
  fit.result.experiments[e].rms_scaled_at_start = std::sqrt(squares_at_start / n);
  const long P = std::ranges::count_if(fit.result.parameters, [](const auto& p) { return p.experiment.empty(); });
  if (!s.none.empty() || P == 0 || !(fit.result.cost_final < fit.result.cost_initial)) return;
  const double chi2 = chi_squared_quantile(static_cast<double>(P), kWorse);
  const double expected = chi2 * s.likelihood_scale * std::max(1.0, s.inflation.maxCoeff()) *
                          std::max(1.0, n / static_cast<double>(fit.result.samples));
  if (squares - squares_at_start > expected)
    fit.result.warnings.push_back(fmt::format(
        "experiment '{}': the fit has lowered its own residuals, but raised those that validate from {:.3g} to "
        "{:.3g} sigma: the values that it found do not hold for other motions. The model leaves something out, or "
        "has parameters that these data do not determine",
        fit.spec.experiments[e].name, std::sqrt(squares_at_start / n), std::sqrt(squares / n)));
}

}  // namespace

void validate(FitContext& fit, std::size_t e) {
  ExperimentStack stack = stack_of(fit, {e}, fit.shared, free_in(fit.scene, fit.spec, e));
  const bool refits = !stack.unknowns().empty();
  const LeastSquaresResult found = refitted(fit, stack);
  ExperimentFit& scored = fit.result.experiments[e];
  scored.message = found.message;
  FitStatistics own;
  if (found.point.z.size() > 0) {
    const std::size_t first = fit.result.residuals.size();
    score_all(fit, stack, found.point.z, false);
    if (refits) own = statistics_at(fit, found, stack);
    const std::optional<Sensitivities> of_samples = sensitivities(fit, e, stack, found);
    if (of_samples && own.none.empty()) {
      if (refits) add_shared_errors(own, stack.scaling().to_rho(found.x), *of_samples, fit.result.statistics.quantile);
      predict_validation(fit, stack, *of_samples, own, first);
    } else if (refits) {
      withhold_errors(own, "those of the shared parameters are not known");
    }
    compare_with_start(fit, e, found.point.z.head(stack.samples()).squaredNorm());
  }
  scored.refitted = described(fit, stack, found.x, own);
  fit.result.simulations += stack.simulations();
}

}  // namespace mbsopt::inline optim
