#include "optim/solver/secant_curvature.hpp"

#include <algorithm>

namespace mbsopt::inline optim {

void SecantCurvature::add(const Eigen::VectorXd& x, const Eigen::VectorXd& f_x) {
  if (!iterates_.empty() && iterates_.back().x == x) return;
  iterates_.push_back({x, f_x});
  if (iterates_.size() > pairs_ + 1) iterates_.pop_front();
}

Eigen::MatrixXd SecantCurvature::matrix() const {
  const Eigen::Index n = iterates_.front().x.size();
  return matrix_from(first_ * Eigen::MatrixXd::Identity(n, n));
}

Eigen::MatrixXd SecantCurvature::matrix_from(const Eigen::MatrixXd& first) const {
  constexpr double kLeast = 1e-8;  // of |s| |y|: less is rounding
  Eigen::MatrixXd B = first;
  for (std::size_t k = 1; k < iterates_.size(); ++k) {
    const auto [s, y] = pair(k);
    if (!(y.dot(s) > kLeast * s.norm() * y.norm())) continue;
    const Eigen::VectorXd Bs = B * s;
    B += y * y.transpose() / y.dot(s);
    if (s.dot(Bs) > 0) B -= Bs * Bs.transpose() / s.dot(Bs);
  }
  return B;
}

bool SecantCurvature::contradicts(const Eigen::MatrixXd& H) const {
  if (iterates_.size() < 2) return false;
  const auto [s, y] = pair(iterates_.size() - 1);
  const Eigen::VectorXd Hs = H * s;
  return (y - Hs).norm() > 0.5 * std::min(y.norm(), Hs.norm());
}

SecantCurvature::Pair SecantCurvature::pair(std::size_t k) const {
  return {iterates_[k].x - iterates_[k - 1].x, iterates_[k].f_x - iterates_[k - 1].f_x};
}

}  // namespace mbsopt::inline optim
