#include "core/integrate/cvodes_newton.hpp"

#include <algorithm>

namespace mbsopt::cvodes {

NewtonMatrix::NewtonMatrix(Flow& flow) : flow_(flow), half_(7 * flow.data().n), lu_(half_) {
  for (Eigen::MatrixXd* x : {&a_q_, &a_v_, &matrix_}) x->setZero(half_, half_);
  b_.setZero(half_);
  no_parameters_.theta.setZero(flow.data().slots(), kLanes);
  std::fill(std::begin(no_parameters_.parameter), std::end(no_parameters_.parameter), -1);
  direction_.setZero(2 * half_, kLanes), change_.setZero(2 * half_, kLanes);
}

bool NewtonMatrix::linearise(double t, const Flow::Numbers& y) {
  if (!flow_.linearise(t, y)) return false;
  for (Eigen::Index first = 0; first < 2 * half_; first += kLanes) {
    const Eigen::Index columns = std::min<Eigen::Index>(kLanes, 2 * half_ - first);
    direction_.setZero();
    for (Eigen::Index k = 0; k < columns; ++k) direction_(first + k, k) = 1;
    flow_.dynamics().tangent(no_parameters_, direction_, change_);
    for (Eigen::Index k = 0; k < columns; ++k) {
      const Eigen::Index column = first + k;
      (column < half_ ? a_q_.col(column) : a_v_.col(column - half_)) = change_.col(k).tail(half_);
    }
  }
  return a_q_.allFinite() && a_v_.allFinite();
}

bool NewtonMatrix::factor(double gamma) {
  gamma_ = gamma;
  matrix_ = -gamma * a_v_ - gamma * gamma * a_q_;
  matrix_.diagonal().array() += 1;
  if (!matrix_.allFinite()) return false;
  lu_.compute(matrix_);
  ++factorisations_;
  return lu_.matrixLU().diagonal().cwiseAbs().minCoeff() > 0;
}

void NewtonMatrix::solve(Eigen::Ref<Eigen::VectorXd> x) {
  b_ = x.tail(half_);
  b_.noalias() += gamma_ * (a_q_ * x.head(half_));
  x.tail(half_) = lu_.solve(b_);
  x.head(half_) += gamma_ * x.tail(half_);
}

void NewtonMatrix::solve_transposed(Eigen::Ref<Eigen::VectorXd> x) {
  b_ = x.tail(half_) + gamma_ * x.head(half_);
  x.tail(half_) = lu_.transpose().solve(b_);
  x.head(half_).noalias() += gamma_ * (a_q_.transpose() * x.tail(half_));
}

}  // namespace mbsopt::cvodes
