// Sentences on the motion that the constraints leave at the assembled start.
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

// degrees_of_freedom is that of the summary. Returns nothing if there is no freedom, or if the motion is uncertain.
std::vector<std::string> free_motions(const Mechanism& mechanism, const Assembly& assembly, double start_time,
                                      int degrees_of_freedom);

// "1 degree of freedom: 'coupler' turns about ..."; the number alone if the motion is uncertain.
std::string freedoms_in_words(const Mechanism& mechanism, const Assembly& assembly, double start_time);

}  // namespace mbsopt
