#include "optim/solver/optimality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "optim/solver/bounded_linear_least_squares.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Bounds nearer than this, relative to the size of the bounded number, may have a multiplier. If such a bound is not
// active, the product of multiplier and slack shows it.
constexpr double kNear = 1e-3;

bool near(double value, double bound) {
  return std::isfinite(bound) && std::abs(value - bound) <= kNear * std::max(1.0, std::abs(bound));
}

// Columns of non-negative multipliers: sign * gradient of constraint i.
struct Multiplier {
  Index constraint;
  double sign;
  double slack;
};

// min |A z - b| subject to z >= 0.
VectorXd non_negative_least_squares(const MatrixXd& A, const VectorXd& b) {
  const VectorXd none = VectorXd::Constant(A.cols(), std::numeric_limits<double>::infinity());
  return bounded_linear_least_squares(A, b, VectorXd::Zero(A.cols()), none);
}

// Near bounds as columns: sign * gradient of a constraint. A step out of a bound near x costs nothing.
struct NearBounds {
  std::vector<Multiplier> constraints;
  std::vector<std::pair<Index, double>> variables;  // x_k, and the sign of the step that leaves the bounds
  MatrixXd columns;                                 // of the constraints, then of the variables
  Index count() const { return static_cast<Index>(constraints.size()); }
};

NearBounds near_bounds(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point,
                       std::vector<Multiplier> constraints) {
  NearBounds found;
  found.constraints = std::move(constraints);
  for (Index k = 0; k < x.size(); ++k) {
    if (near(x(k), problem.x_lower(k))) found.variables.emplace_back(k, -1);
    if (near(x(k), problem.x_upper(k))) found.variables.emplace_back(k, 1);
  }
  found.columns.setZero(x.size(), found.count() + static_cast<Index>(found.variables.size()));
  for (Index j = 0; j < found.count(); ++j) {
    const Multiplier& y = found.constraints[static_cast<std::size_t>(j)];
    found.columns.col(j) = y.sign * problem.c_scale(y.constraint) * point.c_x.row(y.constraint).transpose();
  }
  for (std::size_t j = 0; j < found.variables.size(); ++j)
    found.columns(found.variables[j].first, found.count() + static_cast<Index>(j)) = found.variables[j].second;
  return found;
}

}  // namespace

Stationarity stationarity(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point) {
  VectorXd r = problem.f_scale * point.f_x;
  std::vector<Multiplier> multipliers;
  for (Index i = 0; i < problem.constraints(); ++i) {
    const double c = point.c(i), lower = problem.c_lower(i), upper = problem.c_upper(i);
    if (near(c, upper)) multipliers.push_back({i, 1, upper - c});
    if (near(c, lower)) multipliers.push_back({i, -1, c - lower});
  }
  Stationarity found;
  found.multipliers.setZero(problem.constraints());
  found.pulls.setZero(problem.constraints());
  double complementarity = 0;
  if (!multipliers.empty()) {
    const NearBounds bounds = near_bounds(problem, x, point, std::move(multipliers));
    const VectorXd y = non_negative_least_squares(bounds.columns, -r).head(bounds.count());
    r += bounds.columns.leftCols(bounds.count()) * y;
    for (Index j = 0; j < bounds.count(); ++j) {
      const Multiplier& multiplier = bounds.constraints[static_cast<std::size_t>(j)];
      found.multipliers(multiplier.constraint) += multiplier.sign * y(j);
      complementarity =
          std::max(complementarity, y(j) * problem.c_scale(multiplier.constraint) * std::abs(multiplier.slack));
    }
  }
  for (Index i = 0; i < problem.constraints(); ++i)
    found.pulls(i) = std::abs(found.multipliers(i)) * problem.c_scale(i) * point.c_x.row(i).lpNorm<Eigen::Infinity>();
  const VectorXd step = (-r).cwiseMin(problem.x_upper - x).cwiseMax(problem.x_lower - x);
  found.distance = std::max(step.cwiseAbs().maxCoeff(), complementarity);
  return found;
}

double optimality(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point) {
  return stationarity(problem, x, point).distance;
}

Conflict conflict(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point, double tolerance) {
  Conflict found;
  found.of_constraints.setZero(problem.constraints());
  found.of_bounds.setZero(x.size());
  VectorXd V_x = VectorXd::Zero(x.size());
  std::vector<Multiplier> others;
  for (Index i = 0; i < problem.constraints(); ++i) {
    const double above = point.c(i) - problem.c_upper(i), below = problem.c_lower(i) - point.c(i);
    if (std::max(above, below) > tolerance) {
      found.of_constraints(i) = above > below ? 1 : -1;
      V_x += found.of_constraints(i) * point.c_x.row(i).transpose();
      continue;
    }
    if (near(point.c(i), problem.c_upper(i))) others.push_back({i, 1, -above});
    if (near(point.c(i), problem.c_lower(i))) others.push_back({i, -1, -below});
  }
  const NearBounds bounds = near_bounds(problem, x, point, std::move(others));
  const VectorXd z = non_negative_least_squares(bounds.columns, -V_x);
  for (Index j = 0; j < bounds.count(); ++j) {
    const Multiplier& multiplier = bounds.constraints[static_cast<std::size_t>(j)];
    found.of_constraints(multiplier.constraint) += multiplier.sign * z(j) * problem.c_scale(multiplier.constraint);
  }
  for (std::size_t k = 0; k < bounds.variables.size(); ++k)
    found.of_bounds(bounds.variables[k].first) +=
        bounds.variables[k].second * z(bounds.count() + static_cast<Index>(k));
  const double size = V_x.norm();
  found.residual = size > 0 ? (V_x + bounds.columns * z).norm() / size : 0;
  return found;
}

}  // namespace mbsopt::inline optim
