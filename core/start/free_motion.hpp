// Sentences on the motion that the constraints leave at the assembled start: what each degree of freedom is.
//
//   'coupler' turns about the axis through joints 'B' and 'C'
//   'crank', 'coupler', 'rocker' move together
//
// Docs: docs/cli.md#what-is-free.
#pragma once

#include <string>
#include <vector>

#include "core/start/assembly.hpp"

namespace mbsopt {

// degrees_of_freedom: of the summary. Empty where nothing is free, or where the motion cannot be told for sure.
std::vector<std::string> free_motions(const Mechanism& mechanism, const Assembly& assembly, double start_time,
                                      int degrees_of_freedom);

}  // namespace mbsopt
