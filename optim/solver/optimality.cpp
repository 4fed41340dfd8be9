#include "optim/solver/optimality.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Bounds nearer than this, relative to the size of what they bound, may have a multiplier; what a multiplier makes of a
// bound that is not touched shows in its product with the slack.
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

VectorXd on(const std::vector<Index>& passive, const MatrixXd& A, const VectorXd& b) {
  MatrixXd part(A.rows(), static_cast<Index>(passive.size()));
  for (std::size_t j = 0; j < passive.size(); ++j) part.col(static_cast<Index>(j)) = A.col(passive[j]);
  return part.colPivHouseholderQr().solve(b);
}

}  // namespace

VectorXd non_negative_least_squares(const MatrixXd& A, const VectorXd& b) {
  const Index n = A.cols();
  VectorXd z = VectorXd::Zero(n);
  std::vector<Index> passive;
  std::vector<bool> tried(static_cast<std::size_t>(n), false);
  const double noise = 1e-14 * (A.size() > 0 ? A.cwiseAbs().maxCoeff() : 0) * b.lpNorm<1>();
  for (Index round = 0; round < 3 * n + 3; ++round) {
    const VectorXd w = A.transpose() * (b - A * z);
    Index entering = -1;
    for (Index j = 0; j < n; ++j) {
      if (tried[static_cast<std::size_t>(j)] || std::find(passive.begin(), passive.end(), j) != passive.end()) continue;
      if (w(j) > noise && (entering < 0 || w(j) > w(entering))) entering = j;
    }
    if (entering < 0) break;
    passive.push_back(entering);
    VectorXd s = on(passive, A, b);
    if (s(s.size() - 1) <= 0) {  // by rounding: its column is one of those already in
      passive.pop_back();
      tried[static_cast<std::size_t>(entering)] = true;
      continue;
    }
    while (s.size() > 0 && s.minCoeff() <= 0) {
      double part = 1;  // of the way to s that keeps z >= 0
      for (std::size_t j = 0; j < passive.size(); ++j) {
        const double from = z(passive[j]), to = s(static_cast<Index>(j));
        if (to <= 0) part = std::min(part, from / (from - to));
      }
      std::vector<Index> kept;
      for (std::size_t j = 0; j < passive.size(); ++j) {
        double& value = z(passive[j]);
        const double to = s(static_cast<Index>(j));
        value += part * (to - value);
        if (to <= 0 && value <= 1e-15 * std::abs(to) + std::numeric_limits<double>::min())
          value = 0;
        else
          kept.push_back(passive[j]);
      }
      if (kept.size() == passive.size()) break;
      passive = std::move(kept);
      s = on(passive, A, b);
    }
    for (std::size_t j = 0; j < passive.size(); ++j) z(passive[j]) = std::max(0.0, s(static_cast<Index>(j)));
    std::fill(tried.begin(), tried.end(), false);
  }
  return z;
}

double optimality(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point) {
  const Index n = problem.variables();
  VectorXd r = problem.f_scale * point.f_x;
  std::vector<Multiplier> multipliers;
  for (Index i = 0; i < problem.constraints(); ++i) {
    const double c = point.c(i), lower = problem.c_lower(i), upper = problem.c_upper(i);
    if (near(c, upper)) multipliers.push_back({i, 1, upper - c});
    if (near(c, lower)) multipliers.push_back({i, -1, c - lower});
  }
  double complementarity = 0;
  if (!multipliers.empty()) {
    // A step out of a bound that x is near costs nothing: columns of their own.
    std::vector<std::pair<Index, double>> at_bound;
    for (Index k = 0; k < n; ++k) {
      if (near(x(k), problem.x_lower(k))) at_bound.emplace_back(k, -1);
      if (near(x(k), problem.x_upper(k))) at_bound.emplace_back(k, 1);
    }
    const Index m = static_cast<Index>(multipliers.size());
    MatrixXd A = MatrixXd::Zero(n, m + static_cast<Index>(at_bound.size()));
    for (Index j = 0; j < m; ++j) {
      const Multiplier& y = multipliers[static_cast<std::size_t>(j)];
      A.col(j) = y.sign * problem.c_scale(y.constraint) * point.c_x.row(y.constraint).transpose();
    }
    for (std::size_t j = 0; j < at_bound.size(); ++j)
      A(at_bound[j].first, m + static_cast<Index>(j)) = at_bound[j].second;
    const VectorXd y = non_negative_least_squares(A, -r).head(m);
    r += A.leftCols(m) * y;
    for (Index j = 0; j < m; ++j) {
      const Multiplier& multiplier = multipliers[static_cast<std::size_t>(j)];
      complementarity =
          std::max(complementarity, y(j) * problem.c_scale(multiplier.constraint) * std::abs(multiplier.slack));
    }
  }
  const VectorXd step = (-r).cwiseMin(problem.x_upper - x).cwiseMax(problem.x_lower - x);
  return std::max(step.cwiseAbs().maxCoeff(), complementarity);
}

}  // namespace mbsopt
