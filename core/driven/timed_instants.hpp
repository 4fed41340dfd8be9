// Finds, before a run, the instants at which functions of time alone change (time_parts.hpp): laws of drives (second
// derivatives, which move the forces), forces, running costs and samples.
#pragma once

#include <span>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"

namespace mbsopt {

// Ascending instants of a run, its start and end among them, that are more than `apart` apart. Between two of them each
// function is like a cubic. Adds the instants at which they jump, where panels must end, to `jumps`.
std::vector<double> timed_instants(const Mechanism& mechanism, std::span<const Cost> costs, double start, double end,
                                   double apart, std::vector<double>& jumps);

// The latest end of a panel from t that is not after t1 and resolves the functions: it is at most some times as long as
// the shortest interval between instants in it.
double resolved_until(const std::vector<double>& instants, double t, double t1);

}  // namespace mbsopt
