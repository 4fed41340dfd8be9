#include "optim/solver/residual_curvature.hpp"

#include <cmath>

namespace mbsopt::inline optim {

using Eigen::VectorXd;

void ResidualCurvature::add(const VectorXd& s, const VectorXd& y, const VectorXd& y_sharp) {
  const double rise = y.dot(s);
  if (!(rise > 0)) return;
  const double seen = std::abs(s.dot(y_sharp)), known = std::abs(s.dot(S_ * s));
  if (known > seen) S_ *= seen / known;
  const VectorXd r = y_sharp - S_ * s;
  S_ += (r * y.transpose() + y * r.transpose()) / rise - r.dot(s) / (rise * rise) * y * y.transpose();
}

}  // namespace mbsopt::inline optim
