// The Hermite cubic through two states y = (q, qdot) that are h apart, at the part s of the interval:
//   q(s) = q0 + (3 s^2 - 2 s^3) (q1 - q0) + h ((s^3 - 2 s^2 + s) v0 + (s^3 - s^2) v1),    v(s) = dq/d(h s)
#pragma once

#include <Eigen/Core>

namespace mbsopt {

inline void hermite(const Eigen::Ref<const Eigen::VectorXd>& y0, const Eigen::Ref<const Eigen::VectorXd>& y1, double h,
                    double s, Eigen::VectorXd& y) {
  const double s2 = s * s, s3 = s2 * s;
  const Eigen::Index n = y0.size() / 2;
  y.resize(2 * n);
  const auto q0 = y0.head(n), v0 = y0.tail(n), q1 = y1.head(n), v1 = y1.tail(n);
  y.head(n) = q0 + (3 * s2 - 2 * s3) * (q1 - q0) + h * ((s3 - 2 * s2 + s) * v0 + (s3 - s2) * v1);
  y.tail(n) = (6 * s - 6 * s2) / h * (q1 - q0) + (3 * s2 - 4 * s + 1) * v0 + (3 * s2 - 2 * s) * v1;
}

}  // namespace mbsopt
