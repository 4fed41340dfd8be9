// The result of a projection (projection.hpp), which determines its derivatives, and constants of both projections.
#pragma once

#include <vector>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

inline constexpr double kProjectionAlpha = 1e8;  // times row_alpha
inline constexpr int kMostProjectionIterations = 60;
// Positions are relative to the largest coordinate, velocities to the largest velocity, or to 1 if these are smaller.
inline constexpr double kProjectionRounding = 1e-15, kUnmetPosition = 1e-8, kUnmetVelocity = 1e-6;
// The largest number of refinements of a derivative. A relative change of a few units of rounding ends it earlier.
inline constexpr int kMostRefinements = 12;
inline constexpr double kNegligibleRefinement = 2e-15;

// The largest entry of each direction.
template <class X>
using LargestEntries = Eigen::Array<double, 1, X::ColsAtCompileTime>;
template <class X>
LargestEntries<X> largest(const std::vector<X>& x) {
  LargestEntries<X> most;
  most.setZero();
  for (const X& xi : x) most = most.max(xi.cwiseAbs().colwise().maxCoeff().array());
  return most;
}

// In the plane, each body's entries are (along t1, along t2, about n, 0, 0, 0).
struct ProjectionSolution {
  std::vector<Vec<6>> delta, u;
  Eigen::VectorXd nu, kappa;
};

}  // namespace mbsopt
