// The scatter by rounding of psi and psi_rho over points that are some units in the last place apart. It takes a few
// units, or some 10^4, which are one unit for coordinates at 1 km. It treats each side of rho alone, since a kink at
// rho separates the sides and is no rounding. Parameters without effect show no rounding, so the scene's own numbers
// change as well.
//
//   const RoundingScatter scatter = rounding_scatter(run, seed);     // some 60 runs
#pragma once

#include <Eigen/Core>

#include "optim/check/checked_run.hpp"

namespace mbsopt::inline optim {

struct RoundingScatter {
  Eigen::VectorXd psi;
  Eigen::MatrixXd psi_rho;  // objective x parameter
};

// seed: of the changes to the scene.
RoundingScatter rounding_scatter(CheckedRun& run, unsigned seed);

}  // namespace mbsopt::inline optim
