// Warnings name settings that cost digits, joints that came apart, integrals that the steps do not resolve, and jumps
// outside the derivatives.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt {

// "the law of force 's1' jumps by 2 at t = 0.5 s, an instant that depends on 'tp': ..."; scene is the simulated scene.
std::string in_words(const Scene& scene, const Jump& jump);

// settings: those of the run, which may be by CVODES where the scene's are not. finished: the run reached its end, so
// the caller uses its numbers.
std::vector<std::string> simulation_warnings(const Scene& scene, const SimulationSettings& settings,
                                             const SimulationStatistics& statistics, bool finished = true);

}  // namespace mbsopt
