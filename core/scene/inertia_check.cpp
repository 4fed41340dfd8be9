#include "core/scene/inertia_check.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>

namespace mbsopt {

std::string inertia_problem(const std::array<double, 6>& tensor) {
  constexpr double kTolerance = 1e-6;
  const auto [xx, yy, zz, xy, xz, yz] = tensor;
  Eigen::Matrix3d J;
  J << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  const double scale = J.cwiseAbs().maxCoeff();
  if (scale == 0) return "";
  const Eigen::Vector3d moments =
      scale * Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(J / scale, Eigen::EigenvaluesOnly).eigenvalues();
  const auto rounded = [](double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x);
    return std::string(text);
  };
  const std::string found = "has the principal moments " + rounded(moments(0)) + ", " + rounded(moments(1)) + ", " +
                            rounded(moments(2)) + " kg m^2; ";
  const double slack = kTolerance * std::abs(moments.sum()) + 1e-15 * scale;
  if (moments(0) < -slack) return found + "an inertia tensor must be positive semidefinite, so none may be negative";
  if (moments(2) > moments(0) + moments(1) + slack)
    return found +
           "the largest must not exceed the sum of the other two (for motion in a plane give all three, such as "
           "[J/2, J/2, J])";
  return "";
}

}  // namespace mbsopt
