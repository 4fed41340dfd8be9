// A multistart: one record per start, computed in worker processes (start_workers.hpp) and ranked. The caller defines a
// start. A record holds at least
//
//   {"start": 7, "status": "converged", "message": "...", "objective": 0.12, "infeasibility": 0, "iterations": 9,
//    "evaluations": 12, "simulations": 14, "wall_seconds": 0.8, "from": {"k1": 100}, "parameters": {"k1": 87}}
//
// Results do not depend on the number of workers. The content of the records ranks them, and the number of the start
// decides ties.
#pragma once

#include <string>
#include <vector>

#include "app/files/result_json.hpp"
#include "app/starts/start_workers.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

struct MultistartOutcome {
  std::vector<Json> ranked;  // best first; what failed last
  bool interrupted = false;
  long simulations = 0;      // of all starts, whichever process or earlier run computed them
  double wall_seconds = 0;   // added up over them
  const Json* best() const;  // nullptr: no start has an objective
};

// spec.seed must be set. Adds "multistart" to the result and prints the waterfall.
MultistartOutcome run_multistart(LongRun& long_run, const MultistartSpec& spec, const StartWork& work);

// "412 simulations, 6.9 s in all 20 starts": the words for an optimisation's effort.
std::string effort(const Run& run, long simulations, double wall_seconds);

// The parameters with these names, in their order.
std::vector<Parameter> parameters_of(const Scene& scene, const std::vector<std::string>& names);

// The problem with other values of some parameters, without the multistart.
Problem with_values(Problem problem, const Json& values);

}  // namespace mbsopt::inline app
