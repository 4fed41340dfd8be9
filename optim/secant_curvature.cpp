#include "optim/secant_curvature.hpp"

namespace mbsopt {

void SecantCurvature::add(const Eigen::VectorXd& x, const Eigen::VectorXd& f_x) {
  if (!iterates_.empty() && iterates_.back().x == x) return;
  iterates_.push_back({x, f_x});
  if (iterates_.size() > pairs_ + 1) iterates_.pop_front();
}

Eigen::MatrixXd SecantCurvature::matrix() const {
  constexpr double kLeast = 1e-8;  // of |s| |y|: less is rounding
  const Eigen::Index n = iterates_.front().x.size();
  Eigen::MatrixXd B = first_ * Eigen::MatrixXd::Identity(n, n);
  for (std::size_t k = 1; k < iterates_.size(); ++k) {
    const Eigen::VectorXd s = iterates_[k].x - iterates_[k - 1].x, y = iterates_[k].f_x - iterates_[k - 1].f_x;
    if (!(y.dot(s) > kLeast * s.norm() * y.norm())) continue;
    const Eigen::VectorXd Bs = B * s;
    B += y * y.transpose() / y.dot(s) - Bs * Bs.transpose() / s.dot(Bs);
  }
  return B;
}

}  // namespace mbsopt
