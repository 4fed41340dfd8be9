// sensitivities.csv: the tangent-linear model of the trajectory as a table. A row each output time: t, then per sensor
// and parameter  d SENSOR/d PARAMETER, total derivatives that hold the dependence of the start on the parameters.
#pragma once

#include "app/run/run.hpp"

namespace mbsopt {

// Throws std::invalid_argument where the scene has no sensors or no parameters.
void require_sensitivities(const Scene& scene);

// Runs the tangent-linear model of the problem at its parameters, and writes the file. A run that fails or is stopped
// leaves no file, and the outcome of `run` says so.
void write_sensitivities(Run& run);

}  // namespace mbsopt
