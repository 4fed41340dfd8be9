// What deserves a word about a simulation: settings that cost digits, joints that came apart.
#pragma once

#include <string>
#include <vector>

#include "core/integrate/simulation.hpp"

namespace mbsopt {

// finished: it went through, so that its numbers will be used.
std::vector<std::string> simulation_warnings(const SimulationSettings& settings, const SimulationStatistics& statistics,
                                             bool finished = true);

}  // namespace mbsopt
