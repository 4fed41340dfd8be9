// Bodies that the answer does not depend on, and that are not simulated: what a command says of them.
#pragma once

#include <string>
#include <vector>

#include "app/run/run.hpp"

namespace mbsopt {

// judged_by: "objective", "measurement"
void say_left_out(Run& run, const std::vector<std::string>& bodies, const char* judged_by);

// Of runs with derivatives: blocks evaluated (core/mechanism/derivative_blocks.hpp), and numbers of the model that
// parameters change. Belongs to result.simulation, which is there.
void add_derivative_counts(Run& run, const Scene& simulated, const SimulationStatistics& statistics);

}  // namespace mbsopt
