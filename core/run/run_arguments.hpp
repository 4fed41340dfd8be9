// These checks refuse wrong arguments of a C++ caller before anything runs.
#pragma once

#include <span>

#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class Mechanism;

// Throws std::invalid_argument for an end before the start, samples outside the run, costs that are missing or bound to
// other parameters. It also refuses given steps that do not lead from the start to the end.
void check_run_arguments(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                         std::span<const double> observed, const RunOptions& options);

}  // namespace mbsopt
