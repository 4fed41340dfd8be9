// The run whose gradients are checked, and runs beside it: on its steps, or on steps of their own.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {

// psi carries the rounding of all steps: some units in the last place of the largest numbers in it.
inline constexpr double kPsiRounding = 100 * std::numeric_limits<double>::epsilon();

struct CheckedRun {
  Evaluator evaluator;                                                   // with derivatives in all parameters
  Eigen::VectorXd rho = evaluator.start(), size = evaluator.sizes(rho);  // size: of each parameter in differences
  Eigen::VectorXd psi = {};
  StepSequence steps = {};
  bool discrete = true;  // other runs may take its steps
  // The parameters in which differences on these steps serve.
  Eigen::Array<bool, Eigen::Dynamic, 1> on_frozen_steps = {};
  long simulations = 0;  // beside it

  Evaluation values(const Eigen::VectorXd& there, bool frozen) {
    return counted(frozen ? evaluator.values_on(steps, there) : evaluator.values(there));
  }
  Evaluation frozen_gradients(const Eigen::VectorXd& there, GradientMethod method) {
    return counted(evaluator.gradients_on(steps, there, method));
  }
  Evaluation frozen_gradients(Scene scene, GradientMethod method) {
    return counted(evaluator.in(std::move(scene), method).gradients_on(steps, rho, method));
  }
  Evaluation counted(Evaluation e) {
    simulations += e.simulations;
    return e;
  }
};

// The scatter by rounding of psi and psi_rho over points that are some units in the last place apart. It takes a few
// units, or some 10^4, which are one unit for coordinates at 1 km. It treats each side of rho alone, since a kink at
// rho separates the sides and is no rounding. Parameters without effect show no rounding, so the scene's own numbers
// change as well.
//
//   const RoundingScatter scatter = rounding_scatter(run, seed);     // some 60 runs
struct RoundingScatter {
  Eigen::VectorXd psi;
  Eigen::MatrixXd psi_rho;  // objective x parameter
};

// seed: of the changes to the scene.
RoundingScatter rounding_scatter(CheckedRun& run, unsigned seed);

}  // namespace mbsopt::inline optim
