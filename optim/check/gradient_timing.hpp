// The cost of gradients, in simulations. One simulation is a run of `simulate` with the same objectives, parameters and
// tolerances. It compiles the mechanism, assembles it and integrates in time, with implicit stages to the tolerance of
// the run. Runs with derivatives solve the stages to 1e-12, which is part of their cost. Simulation, TLM and adjoint
// run in turn. A ratio is the median of the ratios of all rounds, so that it holds on a busy machine.
//
//   const GradientTiming timing = time_gradients(problem.scene, objectives_of(problem));
//   timing.adjoint.ratio;     // 2.6
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/force/user_force.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt::inline optim {

class Objective;

struct MethodCost {
  double wall_seconds = 0;  // median of the rounds
  double ratio = 0;         // to one simulation; 0 where nothing is simulated
};

struct GradientTimingOptions {
  int least_rounds = 9, most_rounds = 25;
  double least_seconds = 0.3;  // of all rounds, unless most_rounds are done
  double most_seconds = 10;    // no further round begins after
  std::vector<std::shared_ptr<const UserForce>> user_forces = {};
  std::function<bool(double t)> progress = {};  // within a simulation; false abandons the timing
};

struct GradientTiming {
  bool ok = false;
  std::string message;  // why not
  MethodCost simulation, tlm, adjoint;
  int rounds = 0;
  long simulations = 0;                 // all that were run
  long steps = 0, rhs_evaluations = 0;  // of one simulation
};

// Measures at the parameters' values in the scene, with derivatives in all parameters.
GradientTiming time_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                              const GradientTimingOptions& options = {});

}  // namespace mbsopt::inline optim
