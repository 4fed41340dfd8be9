// The times of the rows of a trajectory.
#pragma once

#include <vector>

#include "core/scene/settings.hpp"

namespace mbsopt {

// start, start + output_step, ..., end: the end is always a row, exactly once.
std::vector<double> output_times(const SimulationSettings& settings);

}  // namespace mbsopt
