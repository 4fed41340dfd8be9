// sensitivities.csv: the tangent-linear model of the trajectory as a table, with a row per output time. Columns are t,
// then per sensor and parameter  d SENSOR/d PARAMETER. These are total derivatives, with the dependence of the start.
#pragma once

#include "app/run/run.hpp"

namespace mbsopt {

// Throws std::invalid_argument if the scene has no sensors or no parameters.
void require_sensitivities(const Scene& scene);

// Runs the tangent-linear model of the problem at its parameters, and writes the file. A failed or stopped run leaves
// no file; the outcome of `run` gives the reason.
void write_sensitivities(Run& run);

}  // namespace mbsopt
