#include "optim/fit/validation.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/linear/dense.hpp"
#include "optim/fit/fit_assessment.hpp"
#include "optim/fit/fit_search.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

// The refit of its own parameters f takes the shared ones s as exact, and compensates their errors as far as it can:
//   f_s = -J_f^+ J_s,   cov(f) = own + f_s cov(s) f_s',   dz/ds = J_s + J_f f_s
// So errors of s add to those of f, and to the intervals of prediction.
void add_errors_of_shared(FitContext& fit, std::size_t e, const ExperimentStack& stack, const VectorXd& x,
                          FitStatistics& own, std::size_t first) {
  std::vector<UnknownParameter> all = stack.unknowns();  // with their values; then the shared ones
  const Index F = std::ssize(all);
  const VectorXd values = stack.scaling().to_rho(x);
  for (Index k = 0; k < F; ++k) all[static_cast<std::size_t>(k)].description.value = values(k);
  for (const UnknownParameter& u : unknowns_of_fit(fit.scene, fit.spec)) {
    if (!u.shared) break;  // the shared unknowns come first
    all.push_back(u);
    all.back().description.value = fit.shared(u.parameter);
  }
  const Index S = std::ssize(all) - F;
  ExperimentStack whole = stack_of(fit, {e}, fit.shared, std::move(all));
  const VectorXd x_whole = whole.start();
  const LeastSquaresPoint point = whole.at(x_whole);
  fit.result.simulations += whole.simulations();
  if (!point.ok) return;
  const FitStatistics& s = fit.result.statistics;
  const MatrixXd J = whole.z_rho(point, x_whole).topRows(stack.samples()), J_f = J.leftCols(F);
  const MatrixXd of_shared = s.covariance.topLeftCorner(S, S);
  MatrixXd z_s = J.rightCols(S);
  VectorXd variances = VectorXd::Zero(J.rows());
  if (F > 0) {
    variances = (J_f * own.covariance).cwiseProduct(J_f).rowwise().sum();
    const MatrixXd f_s = -OrthogonalDecomposition(J_f).solve(z_s);
    z_s += J_f * f_s;
    const VectorXd added = (f_s * of_shared).cwiseProduct(f_s).rowwise().sum();
    own.std_error = (own.std_error.cwiseAbs2() + added).cwiseSqrt();
    own.quantile = std::max(own.quantile, s.quantile);
  }
  variances += (z_s * of_shared).cwiseProduct(z_s).rowwise().sum();
  predict(fit, stack, variances, first);
}

}  // namespace

void validate(FitContext& fit, std::size_t e) {
  ExperimentStack stack = stack_of(fit, {e}, fit.shared, free_in(fit.scene, fit.spec, e));
  const LeastSquaresResult found = refitted(fit, stack);
  ExperimentFit& scored = fit.result.experiments[e];
  scored.message = found.message;
  FitStatistics own;
  if (found.point.z.size() > 0) {
    const std::size_t first = fit.result.residuals.size();
    score_all(fit, stack, found.point.z, false);
    if (!stack.unknowns().empty()) own = statistics_at(fit, found, stack);
    if (!fit.result.statistics.none.empty()) withhold_errors(own, "those of the shared parameters are not known");
    if (own.none.empty()) add_errors_of_shared(fit, e, stack, found.x, own, first);
  }
  scored.refitted = described(fit, stack, found.x, own);
  fit.result.simulations += stack.simulations();
}

}  // namespace mbsopt::inline optim
