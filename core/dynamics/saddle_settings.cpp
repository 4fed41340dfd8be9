#include "core/dynamics/saddle_settings.hpp"

#include <algorithm>
#include <cmath>

#include "core/mechanism/joint_graph.hpp"

namespace mbsopt {
namespace {

// alpha of S for the quasi-definite solution, which does not depend on it. It is large against any inertia, so that few
// refinements suffice: a row between light bodies may have to move heavy ones behind them. It is small enough for S to
// keep the smallest inertia. It equals the penalty or is far below it: between the two, refinements would converge
// slowly at redundant rows.
double moderate_alpha(const MechanismData& data, double penalty) {
  if (data.m == 0) return penalty;
  double least = data.row_alpha.minCoeff(), most = data.row_alpha.maxCoeff();
  for (const BodyData& b : data.bodies) {
    most = std::max({most, b.mass, b.J.trace()});
    if (b.mass > 0) least = std::min(least, b.mass);
    if (b.J.trace() > 0) least = std::min(least, b.J.trace());
  }
  const double moderate = std::clamp(1e11 * least, 1e3 * most, 1e7 * most);
  return penalty <= moderate ? penalty : std::min(moderate, penalty / 100);
}

// Along a chain of L joints the least eigenvalue of J inv(M) J' falls as 1/L^2, and the gain of a pass falls with it.
// Above ten times alpha, convergence to rounding takes a third pass. Chains of hundreds of joints need it anyway in
// space, but not in the plane (docs/formulations.md).
double alpha_along_chains(const MechanismData& data) {
  constexpr double kLong = 316;
  const double L = joints_to_farthest_body(data);
  if (data.planar || L < kLong) return std::clamp(L * L / 10, 1.0, 10.0);
  return std::clamp(L * L / 1000, 10.0, 1000.0);
}

constexpr double kDerivativeTolerance = 1e-12;

SaddleSettings constrained(const MechanismData& data, const FormulationSettings& settings) {
  const double alpha = settings.alpha * alpha_along_chains(data), digits = std::max(1.0, std::log10(alpha));
  // S loses digits of M to alpha; so many passes reduce this error to rounding.
  const int rounding = std::clamp(static_cast<int>(std::ceil(14 / std::max(1.0, 16 - digits))) - 1, 1, 14);
  // Derivatives are those of the limit: so many passes reduce alpha^-(passes) to rounding. More follow until J x' is
  // exact: an error of J x' moves along M^-1 J', which the projection's derivative removes.
  const int exact = std::max(rounding, std::clamp(static_cast<int>(std::ceil(15 / digits)) - 1, 1, 8));
  return {alpha * data.row_alpha,
          0,
          {std::min(rounding, settings.iterations), settings.iterations, settings.tolerance},
          {exact, std::max(exact, settings.iterations), kDerivativeTolerance}};
}

}  // namespace

SaddleSettings saddle_settings(const MechanismData& data, const FormulationSettings& settings) {
  if (settings.type == FormulationType::augmented_lagrangian) return constrained(data, settings);
  const bool moderate = settings.linear_solver == LinearSolver::quasidefinite;
  const double alpha = moderate ? moderate_alpha(data, settings.alpha) : settings.alpha,
               compliance = 1 / settings.alpha;
  const Eigen::VectorXd alphas = Eigen::VectorXd::Constant(data.m, alpha);
  if (moderate) return {alphas, compliance, {2, 50, 1e-15}, {2, 50, 1e-15}};
  // In derivatives, one pass removes the rounding of S, which would separate tangent and adjoint.
  return {alphas, compliance, {}, {1, 1, 0}};
}

}  // namespace mbsopt
