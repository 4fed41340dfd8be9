#include "core/dynamics/saddle_settings.hpp"

#include <algorithm>
#include <cmath>

#include "core/mechanism/joint_graph.hpp"

namespace mbsopt {
namespace {

// Chooses alpha of S for the quasi-definite solution, which does not depend on it. A large alpha needs few refinements:
// a row between light bodies may have to move heavy ones behind them. A larger one would lose the smallest inertia in
// S. It takes that of the penalty itself, or one far from it: in between, refinements of redundant rows would hardly
// converge.
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

// Along a chain of L joints the least eigenvalue of J inv(M) J' falls as 1/L^2, and with it what a pass gains. Above
// ten times alpha, rounding takes a third pass. Chains of hundreds of joints in space need that pass anyway, chains in
// the plane do not (docs/formulations.md).
double alpha_along_chains(const MechanismData& data) {
  constexpr double kLong = 316;
  const double L = joints_to_farthest_body(data);
  if (data.planar || L < kLong) return std::clamp(L * L / 10, 1.0, 10.0);
  return std::clamp(L * L / 1000, 10.0, 1000.0);
}

constexpr double kDerivativeTolerance = 1e-12;

SaddleSettings constrained(const MechanismData& data, const FormulationSettings& settings) {
  const double alpha = settings.alpha * alpha_along_chains(data), digits = std::max(1.0, std::log10(alpha));
  // So many passes bring the part of M that S loses to alpha down to rounding.
  const int rounding = std::clamp(static_cast<int>(std::ceil(14 / std::max(1.0, 16 - digits))) - 1, 1, 14);
  // Derivatives are those of the limit: passes go on until alpha^-(passes) is rounding and J x' is right. An error of J
  // x' moves along M^-1 J', which the projection's derivative removes.
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
  const Refinements refinements = moderate ? Refinements{2, 50, 1e-15} : Refinements{};
  const double alpha = moderate ? moderate_alpha(data, settings.alpha) : settings.alpha;
  return {Eigen::VectorXd::Constant(data.m, alpha), 1 / settings.alpha, refinements, refinements};
}

}  // namespace mbsopt
