// The laws of drives (second derivatives, which move the forces) and forces, and the running costs, as far as they
// depend on time and parameters alone, with the instants of a run at which they change (time_parts.hpp), jump or have
// kinks.
#pragma once

#include <span>
#include <vector>

#include "core/expression/program.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/run/cost.hpp"

namespace mbsopt {

struct TimedLaw {
  Program part;                // inputs: timed_inputs()
  int time = 0;                // the input t
  int force = -1, drive = -1;  // the index in the scene; none of a cost
  std::vector<double> pieces;  // start, the instants between, end
  std::vector<double> jumps;   // the instants at which the part jumps
};

// All parameters, and zeros for the motion and t.
std::vector<double> timed_inputs(const Mechanism& mechanism);

std::vector<TimedLaw> timed_laws(const Mechanism& mechanism, std::span<const Cost> costs, double start, double end);

// The samples of all laws and running costs.
std::vector<KinkedSignal> kinks_of(const Mechanism& mechanism, std::span<const Cost> costs);

}  // namespace mbsopt
