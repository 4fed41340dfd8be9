// What a projection found (projection.hpp); enough to differentiate it later.
#pragma once

#include <vector>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// Constants of both projections, in space and in the plane.
inline constexpr double kProjectionAlpha = 1e8;  // times row_alpha
inline constexpr int kMostProjectionIterations = 60;
// Of the largest coordinate and velocity, at least of 1.
inline constexpr double kProjectionRounding = 1e-15, kUnmetPosition = 1e-8, kUnmetVelocity = 1e-6;
// Derivatives: passes of refinement, and relative what the next pass would change: several units of rounding.
inline constexpr int kMostRefinements = 12;
inline constexpr double kNegligibleRefinement = 2e-15;

// Largest entry of each direction.
template <class X>
Eigen::Array<double, 1, X::ColsAtCompileTime> largest(const std::vector<X>& x) {
  Eigen::Array<double, 1, X::ColsAtCompileTime> most;
  most.setZero();
  for (const X& xi : x) most = most.max(xi.cwiseAbs().colwise().maxCoeff().array());
  return most;
}

// In the plane each body's entries are (along t1, along t2, about n, 0, 0, 0).
struct ProjectionSolution {
  std::vector<Vec<6>> delta, u;
  Eigen::VectorXd nu, kappa;
};

}  // namespace mbsopt
