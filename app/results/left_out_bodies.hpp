// Messages on bodies that do not affect the answer and are not simulated.
#pragma once

#include <string>
#include <vector>

#include "app/run/run.hpp"

namespace mbsopt {

// judged_by: "objective", "measurement"
void say_left_out(Run& run, const std::vector<std::string>& bodies, const char* judged_by);

// Adds counts of runs with derivatives to result.simulation, which must exist: blocks evaluated
// (core/mechanism/derivative_blocks.hpp), and numbers of the model that parameters change.
void add_derivative_counts(Run& run, const Scene& simulated, const SimulationStatistics& statistics);

}  // namespace mbsopt
