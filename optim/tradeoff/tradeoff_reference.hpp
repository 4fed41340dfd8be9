// The right answer of a problem, from two methods that share no table. Each takes tighter tolerances until its answer
// no longer settles (rounding) or costs too much. The difference of the two is the reference's certificate.
//
// The methods are dopri853 (explicit) and gauss6 (implicit). verner6 and radau5 replace one that fails (stiff motion,
// singular positions). If equations were not satisfied near singular positions, gauss6 and radau5 also take steps of
// one size. Step-size control would take ever shorter steps there, and some stage would come too close. The equations
// are the constrained ones (augmented Lagrangian, projected) for any scene.
//
//   const TradeoffReference reference = converged_reference(runs);
//   if (reference.ok()) reference.errors->of(answer);
#pragma once

#include <optional>
#include <string>

#include "optim/tradeoff/tradeoff_errors.hpp"

namespace mbsopt::inline optim {

struct ReferenceMethod {
  std::string integrator;
  double rtol = 0;
  std::optional<double> step;  // fixed: there is no rtol
  double wall_seconds = 0;     // of its last simulation
};

// "gauss6 at rtol 1e-11", "gauss6 with steps of 0.005 s"
std::string in_words(const ReferenceMethod& method);

struct TradeoffReference {
  std::string message;                   // why there is none
  std::optional<TradeoffErrors> errors;  // against it
  ReferenceMethod first, second;         // the answer is that of the first
  std::string gradients_by;              // tlm, adjoint, and on which steps, if not these; empty: none
  double wall_seconds = 0;
  bool interrupted = false;
  bool ok() const { return errors.has_value(); }
};

struct ReferenceOptions {
  double seconds_per_run = 10;  // a run that would take longer is left out
  bool gradients = true;
  std::function<bool()> interrupted = {};
  Clock clock = {};  // of seconds_per_run
  // done: 0..1, of the run that `doing` names
  std::function<void(const std::string& doing, double done)> progress = {};
};

TradeoffReference converged_reference(const TradeoffRuns& runs, const ReferenceOptions& options = {});

// The scene's settings with another integrator at a tolerance. atol has the ratio of the scene, or 1e-2 of rtol if the
// scene has a fixed step.
SimulationSettings with_tolerance(SimulationSettings settings, const std::string& integrator, double rtol);

// The scene's settings with the program's default integrator and formulation.
SimulationSettings with_defaults(SimulationSettings settings);

// The constrained equations: the scene's own formulation if it is an augmented Lagrangian with full projection.
FormulationSettings constrained(const FormulationSettings& formulation);

}  // namespace mbsopt::inline optim
