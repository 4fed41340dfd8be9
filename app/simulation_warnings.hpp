// What deserves a word about a simulation that went through: settings that cost digits, joints that came apart.
#pragma once

#include <string>
#include <vector>

#include "core/integrate/simulation.hpp"

namespace mbsopt {

std::vector<std::string> simulation_warnings(const SimulationSettings& settings,
                                             const SimulationStatistics& statistics);

}  // namespace mbsopt
