#include "core/step/shifted_system.hpp"

namespace mbsopt {

ShiftedSystem::ShiftedSystem(const MechanismData& data, const MotionJacobian& jacobian)
    : jacobian_(&jacobian), matrix_(data, jacobian, 1), half_(7 * data.n) {
  r_.setZero(matrix_.size(), 1);
  y_.setZero(2 * half_);
}

bool ShiftedSystem::factor(double gamma, const MotionJacobian::Values& values) {
  values_ = &values;
  gamma_ = gamma;
  return matrix_.factor(gamma, one_, std::span(&values_, 1));
}

void ShiftedSystem::solve(Eigen::Ref<Eigen::VectorXd> x, int refinements) {
  auto x_q = x.head(half_), x_v = x.tail(half_);
  x_q += gamma_ * x_v;
  r_.setZero();
  std::size_t k = 0;
  for (const auto& p : jacobian_->pairs()) {
    r_.col(0).segment<7>(7 * p.row) -=
        values_->q[k] * x_q.segment<7>(7 * p.body) + values_->v[k] * x_v.segment<7>(7 * p.body);
    ++k;
  }
  k = 0;
  for (const auto& row : jacobian_->rows()) {
    r_(half_ + row.row, 0) -=
        values_->row_q[k].dot(x_q.segment<7>(7 * row.body)) + values_->row_v[k].dot(x_v.segment<7>(7 * row.body));
    ++k;
  }
  matrix_.solve(r_, refinements);
  x_v += gamma_ * r_.col(0).head(half_);
  x_q += gamma_ * gamma_ * r_.col(0).head(half_);
}

void ShiftedSystem::solve_transposed(Eigen::Ref<Eigen::VectorXd> x, int refinements) {
  auto x_q = x.head(half_), x_v = x.tail(half_);
  x_v += gamma_ * x_q;
  r_.setZero();
  r_.col(0).head(half_) = gamma_ * x_v;
  matrix_.solve_transposed(r_, refinements);
  y_.setZero();
  std::size_t k = 0;
  for (const auto& p : jacobian_->pairs()) {
    const Vec<7> beta = r_.col(0).segment<7>(7 * p.row);
    y_.segment<7>(7 * p.body) -= values_->q[k].transpose() * beta;
    y_.segment<7>(half_ + 7 * p.body) -= values_->v[k].transpose() * beta;
    ++k;
  }
  k = 0;
  for (const auto& row : jacobian_->rows()) {
    const double beta = r_(half_ + row.row, 0);
    y_.segment<7>(7 * row.body) -= beta * values_->row_q[k].transpose();
    y_.segment<7>(half_ + 7 * row.body) -= beta * values_->row_v[k].transpose();
    ++k;
  }
  x_q += y_.head(half_);
  x_v += gamma_ * y_.head(half_) + y_.tail(half_);
}

}  // namespace mbsopt
