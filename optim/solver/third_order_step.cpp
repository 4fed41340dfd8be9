#include "optim/solver/third_order_step.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/linear/dense.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<Index> where(const VectorXd& d) {
  std::vector<Index> indices;
  for (Index k = 0; k < d.size(); ++k)
    if (d(k) != 0) indices.push_back(k);
  return indices;
}

// The part of s along d; none if the model is too far from f.
std::optional<double> along(double tau) {
  if (!(tau > -1)) return std::nullopt;
  return 2 / (1 + std::sqrt(std::max(0.0, 1 + 2 * tau)));
}

}  // namespace

std::optional<VectorXd> newton_step(const NonlinearProgram& problem, const VectorXd& x, const VectorXd& f_x,
                                    const MatrixXd& H) {
  constexpr double kTouches = 1e-6;  // a barrier keeps its distance
  std::vector<Index> free;
  for (Index k = 0; k < x.size(); ++k) {
    const double room = f_x(k) > 0 ? x(k) - problem.x_lower(k) : problem.x_upper(k) - x(k);
    if (room > kTouches * std::max(1.0, std::abs(x(k)))) free.push_back(k);
  }
  if (free.empty()) return std::nullopt;
  const VectorXd H_f_x = definite_solve(H(free, free), f_x(free), 0);
  if (H_f_x.size() == 0) return std::nullopt;
  VectorXd d = VectorXd::Zero(x.size());
  d(free) = -H_f_x;
  const VectorXd there = x + d;
  const bool within =
      (there.array() >= problem.x_lower.array()).all() && (there.array() <= problem.x_upper.array()).all();
  if (!there.allFinite() || !within) return std::nullopt;
  return d;
}

std::optional<MatrixXd> third_order_hessian(const MatrixXd& H, const VectorXd& d, const VectorXd& t) {
  const std::vector<Index> free = where(d);
  if (free.empty() || !t.allFinite()) return std::nullopt;
  const MatrixXd H_free = H(free, free);
  const VectorXd d_free = d(free), t_free = t(free);
  const double dHd = d_free.dot(H_free * d_free), tau = t_free.dot(d_free) / dHd;
  const std::optional<double> beta = along(tau);
  if (!beta) return std::nullopt;
  const double half = *beta * *beta / 2;
  const VectorXd across = half * (cholesky_solve(H_free, t_free) - tau * d_free);
  if (!(across.dot(H_free * across) <= *beta * *beta * dHd)) return std::nullopt;
  VectorXd s = VectorXd::Zero(d.size());
  s(free) = *beta * d_free - across;
  const VectorXd Hs = H * s;
  VectorXd y = Hs + half * t;
  y(free) = H_free * d_free;  // -f_x, the same where the model has a zero
  return MatrixXd(H - Hs * Hs.transpose() / s.dot(Hs) + y * y.transpose() / y.dot(s));
}

}  // namespace mbsopt
