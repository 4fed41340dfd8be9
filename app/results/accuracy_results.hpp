// simulation.accuracy of a problem: chooses integrator and tolerances once (optim/tradeoff/accuracy.hpp), at the
// parameters of the file. The choice, its reason and the expected error go to standard output and into the result.
#pragma once

#include "app/run/run.hpp"
#include "optim/tradeoff/accuracy.hpp"

namespace mbsopt::inline app {

// Replaces the accuracy of the run's problem by settings. It does nothing if the file requests no accuracy. It takes
// the program's defaults, with a warning, if it finds none. Call it between start() and the first simulation. Returns
// false if the user interrupted it, which then is the outcome of the run.
bool settle_accuracy(Run& run);
// Does the same for another scene than that of the file, and its objectives.
bool settle_accuracy(Run& run, const Scene& simulated, const std::vector<Objective>& objectives);

// Warns if stability limits the steps of an explicit method.
void warn_of_stiffness(Run& run, const SimulationStatistics& statistics, bool differentiated);

}  // namespace mbsopt::inline app
