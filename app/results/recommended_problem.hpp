// recommended.json: the problem of a run, --set included, with other integrator and formulation settings; a problem
// file itself. Comments and formatting stay as they were written, but inside simulation.integrator and .formulation.
#pragma once

#include <string>

#include "core/scene/settings.hpp"

namespace mbsopt {

class Run;

std::string recommended_problem_text(const Run& run, const SimulationSettings& settings);

}  // namespace mbsopt
