#include "optim/solver/least_squares.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::VectorXd;

double ScaleGroup::squared_scale(const VectorXd& z) const {
  double squares = 0;
  for (const Index i : rows) squares += z(i) * z(i);
  return std::max(squares / freedom, least);
}

VectorXd LeastSquaresProblem::weights(const VectorXd& z) const {
  VectorXd w = VectorXd::Ones(z.size());
  if (loss.type != LossType::squared)
    for (Index i = 0; i < z.size() - plain - equalities; ++i) w(i) = loss.at(z(i) * z(i)).rho1;
  for (const ScaleGroup& group : groups) {
    const double s2 = group.squared_scale(z);
    for (const Index i : group.rows) w(i) = 1 / s2;
  }
  return w;
}

double LeastSquaresProblem::cost(const VectorXd& z) const {
  const Index residuals = z.size() - equalities;
  if (groups.empty() && loss.type == LossType::squared) return 0.5 * z.head(residuals).squaredNorm();
  double sum = z.head(residuals).tail(plain).squaredNorm();
  VectorXd scaled = z;
  double logarithms = 0;
  for (const ScaleGroup& group : groups) {
    const double s2 = group.squared_scale(z);
    logarithms += group.freedom * std::log(s2);
    for (const Index i : group.rows) scaled(i) /= std::sqrt(s2);
  }
  for (Index i = 0; i < residuals - plain; ++i) sum += loss.at(scaled(i) * scaled(i)).rho;
  return 0.5 * (sum + logarithms);
}

VectorXd LeastSquaresProblem::pull(const VectorXd& z) const { return weights(z).cwiseProduct(z); }

}  // namespace mbsopt::inline optim
