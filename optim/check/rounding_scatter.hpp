// The scatter by rounding of psi and psi_rho over points that are some units in the last place apart. It takes a few
// units, or some 10^4, which are one unit for coordinates at 1 km. It treats each side of rho alone, since a kink at
// rho separates the sides and is no rounding. Parameters without effect show no rounding, so the scene's own numbers
// change as well.
//
//   const RoundingScatter scatter = rounding_scatter(base, {at, of});     // some 60 runs
#pragma once

#include <Eigen/Core>
#include <functional>

#include "core/scene/scene.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {

struct RoundingScatter {
  Eigen::VectorXd psi;
  Eigen::MatrixXd psi_rho;  // objective x parameter
  long simulations = 0;
};

// The point at which scatter is measured. size is that of each parameter in differences.
struct RoundingBase {
  const Scene& scene;
  Eigen::VectorXd rho, size, psi;
  double rounding;  // of psi, relative, at least
  unsigned seed;    // of the changes to the scene
};
// Gradients on the steps of the base run.
struct RoundingRuns {
  std::function<Evaluation(const Eigen::VectorXd& rho, GradientMethod method)> at;
  std::function<Evaluation(const Scene& scene, GradientMethod method)> of;
};

RoundingScatter rounding_scatter(const RoundingBase& base, const RoundingRuns& runs);

}  // namespace mbsopt::inline optim
