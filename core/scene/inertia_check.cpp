#include "core/scene/inertia_check.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>

#include "core/linear/dense.hpp"

namespace mbsopt {

std::string inertia_problem(const std::array<double, 6>& tensor) {
  constexpr double kTolerance = 1e-6;
  const auto [xx, yy, zz, xy, xz, yz] = tensor;
  Eigen::Matrix3d J;
  J << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  const double scale = J.cwiseAbs().maxCoeff();
  if (scale == 0) return "";
  const Eigen::Vector3d moments = scale * symmetric_eigenvalues(J / scale);
  const std::string found =
      fmt::format("has the principal moments {:.4g}, {:.4g}, {:.4g} kg m^2; ", moments(0), moments(1), moments(2));
  const double slack = kTolerance * std::abs(moments.sum()) + 1e-15 * scale;
  if (moments(0) < -slack) return found + "an inertia tensor must be positive semidefinite, so none may be negative";
  if (moments(2) > moments(0) + moments(1) + slack)
    return found +
           "the largest must not exceed the sum of the other two (for motion in a plane give all three, such as "
           "[J/2, J/2, J])";
  return "";
}

}  // namespace mbsopt
