// simulation.accuracy of a problem: integrator and tolerances chosen (optim/tradeoff/accuracy.hpp), once, at the
// parameters of the file; what was chosen, why, and the error to be expected go to standard output and into the result.
#pragma once

#include "app/run/run.hpp"
#include "optim/tradeoff/accuracy.hpp"

namespace mbsopt {

// From here on the run's problem has settings as any other. Nothing where the file asks for no accuracy; the program's
// defaults, with a warning, where none could be chosen. Call it between start() and what simulates. False where the
// user interrupted it, which then is how the run ended.
bool settle_accuracy(Run& run);
// The same for another scene than that of the file, and the objectives that count.
bool settle_accuracy(Run& run, const Scene& simulated, const std::vector<Objective>& objectives);

// Warns where an explicit method's steps are limited by stability.
void warn_of_stiffness(Run& run, const SimulationStatistics& statistics, bool differentiated);

}  // namespace mbsopt
