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

// Columns of non-negative multipliers: sign * gradient of constraint i, or of a piece of f.
struct Multiplier {
  Index constraint;  // NlpPiece::row
  double sign;
  double slack;  // scaled
  VectorXd column;
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

NearBounds near_bounds(const NonlinearProgram& problem, const VectorXd& x, std::vector<Multiplier> constraints) {
  NearBounds found;
  found.constraints = std::move(constraints);
  for (Index k = 0; k < x.size(); ++k) {
    if (near(x(k), problem.x_lower(k))) found.variables.emplace_back(k, -1);
    if (near(x(k), problem.x_upper(k))) found.variables.emplace_back(k, 1);
  }
  found.columns.setZero(x.size(), found.count() + static_cast<Index>(found.variables.size()));
  for (Index j = 0; j < found.count(); ++j) {
    found.columns.col(j) = found.constraints[static_cast<std::size_t>(j)].column;
  }
  for (std::size_t j = 0; j < found.variables.size(); ++j)
    found.columns(found.variables[j].first, found.count() + static_cast<Index>(j)) = found.variables[j].second;
  return found;
}

// The bounds of constraint i that are near; those of each piece where it has some on that side.
void add_near(const NonlinearProgram& problem, const NlpPoint& point, Index i, std::vector<Multiplier>& found) {
  const double scale = problem.c_scale(i);
  for (const double side : {1., -1.}) {
    const double bound = side > 0 ? problem.c_upper(i) : problem.c_lower(i);
    bool has_pieces = false;
    for (const NlpPiece& piece : point.pieces) {
      if (piece.row != i || piece.side != side) continue;
      has_pieces = true;
      if (near(piece.value, bound))
        found.push_back({i, side, scale * std::abs(bound - piece.value), side * scale * piece.gradient});
    }
    if (!has_pieces && near(point.c(i), bound))
      found.push_back({i, side, scale * std::abs(bound - point.c(i)), side * scale * point.c_x.row(i).transpose()});
  }
}

// The pieces of f that come near the largest of their extreme: y moves its weight from that one to them.
void add_near_pieces(const NonlinearProgram& problem, const NlpPoint& point, std::vector<Multiplier>& found) {
  constexpr double kSame = 1e-12;  // of the gradients: pieces that differ by rounding have no weight to exchange
  const NlpPiece* top = nullptr;
  for (const NlpPiece& piece : point.pieces) {
    if (piece.row >= 0) continue;
    if (!top || top->row != piece.row) {
      top = &piece;
      continue;
    }
    if ((piece.gradient - top->gradient).norm() <= kSame * top->gradient.norm()) continue;
    const double slack = problem.f_scale * std::abs(top->value - piece.value);
    if (slack <= kNear * std::max(1.0, problem.f_scale * std::abs(top->value)))
      found.push_back({piece.row, 1, slack, problem.f_scale * (piece.gradient - top->gradient)});
  }
}

}  // namespace

namespace {

// slacks: how much multiplier times slack counts beside r.
Stationarity balanced(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point,
                      const NearBounds& bounds, double slacks) {
  Stationarity found;
  found.multipliers.setZero(problem.constraints());
  found.pulls.setZero(problem.constraints());
  MatrixXd A = MatrixXd::Zero(x.size() + bounds.count(), bounds.columns.cols());
  A.topRows(x.size()) = bounds.columns;
  for (Index j = 0; j < bounds.count(); ++j)
    A(x.size() + j, j) = slacks * bounds.constraints[static_cast<std::size_t>(j)].slack;
  VectorXd b = VectorXd::Zero(A.rows());
  b.head(x.size()) = -problem.f_scale * point.f_x;
  VectorXd y = VectorXd::Zero(bounds.count());
  if (bounds.count() > 0) y = non_negative_least_squares(A, b).head(bounds.count());
  const VectorXd r = problem.f_scale * point.f_x + bounds.columns.leftCols(bounds.count()) * y;
  double complementarity = 0;
  for (Index j = 0; j < bounds.count(); ++j) {
    const Multiplier& multiplier = bounds.constraints[static_cast<std::size_t>(j)];
    if (multiplier.constraint >= 0) found.multipliers(multiplier.constraint) += multiplier.sign * y(j);
    complementarity = std::max(complementarity, y(j) * multiplier.slack);
  }
  for (Index i = 0; i < problem.constraints(); ++i)
    found.pulls(i) = std::abs(found.multipliers(i)) * problem.c_scale(i) * point.c_x.row(i).lpNorm<Eigen::Infinity>();
  const VectorXd step = (-r).cwiseMin(problem.x_upper - x).cwiseMax(problem.x_lower - x);
  found.distance = std::max(step.cwiseAbs().maxCoeff(), complementarity);
  return found;
}

}  // namespace

// Among several bounds with one gradient the multipliers may be those of distant ones. Then they are chosen again, by
// slacks, too. Otherwise as few of them as possible are above 0.
Stationarity stationarity(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point) {
  constexpr double kClearly = 0.1;
  std::vector<Multiplier> multipliers;
  add_near_pieces(problem, point, multipliers);
  for (Index i = 0; i < problem.constraints(); ++i) add_near(problem, point, i, multipliers);
  const NearBounds bounds = near_bounds(problem, x, std::move(multipliers));
  Stationarity by_r = balanced(problem, x, point, bounds, 0);
  if (bounds.count() == 0) return by_r;
  Stationarity by_slacks = balanced(problem, x, point, bounds, 1);
  return by_slacks.distance < kClearly * by_r.distance ? by_slacks : by_r;
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
    add_near(problem, point, i, others);
  }
  const NearBounds bounds = near_bounds(problem, x, std::move(others));
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
