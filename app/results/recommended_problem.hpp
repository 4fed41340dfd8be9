// recommended.json: the problem of a run with --set and other integrator and formulation settings. It is a problem file
// itself. Comments and formatting stay, except inside simulation.integrator and .formulation.
#pragma once

#include <string>

#include "core/scene/settings.hpp"

namespace mbsopt {

class Run;

std::string recommended_problem_text(const Run& run, const SimulationSettings& settings);

}  // namespace mbsopt
