// What a projection found (projection.hpp); enough to differentiate it later.
#pragma once

#include <vector>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// In the plane each body's entries are (along t1, along t2, about n, 0, 0, 0).
struct ProjectionSolution {
  std::vector<Vec<6>> delta, u;
  Eigen::VectorXd nu, kappa;
};

}  // namespace mbsopt
