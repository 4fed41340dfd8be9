#include "optim/solver/least_squares.hpp"

namespace mbsopt {

double LeastSquaresProblem::cost(const Eigen::VectorXd& z) const {
  if (loss.type == LossType::squared) return 0.5 * z.squaredNorm();
  const Eigen::Index robust = z.size() - plain;
  double sum = z.tail(plain).squaredNorm();
  for (Eigen::Index i = 0; i < robust; ++i) sum += loss.at(z(i) * z(i)).rho;
  return 0.5 * sum;
}

Eigen::VectorXd LeastSquaresProblem::pull(const Eigen::VectorXd& z) const {
  Eigen::VectorXd p = z;
  if (loss.type == LossType::squared) return p;
  for (Eigen::Index i = 0; i < z.size() - plain; ++i) p(i) *= loss.at(z(i) * z(i)).rho1;
  return p;
}

}  // namespace mbsopt
