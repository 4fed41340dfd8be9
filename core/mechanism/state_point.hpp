// The state at one instant, as costs, sensors and observers see it.
#pragma once

#include <Eigen/Core>

namespace mbsopt {

struct StatePoint {
  double t;                  // [s]
  const Eigen::VectorXd& y;  // (q, v): q has 7 numbers per body (r_g, p), v = qdot
  const Eigen::VectorXd&
      angles;  // per tracked joint: an angle on the branch in use; size 0 where none is tracked [rad]
};

}  // namespace mbsopt
