// Sentences on the motion that the constraints leave at the assembled start, and on motions that they forbid twice.
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

// The motions that redundant equations forbid a second time, a sentence per joint:
//
//   joint 'D' forbids again that 'rocker_bar' slides along [0, 0, 1], turns about every axis normal to [0, 0, 1]
std::vector<std::string> motions_forbidden_twice(const Mechanism& mechanism, const Assembly& assembly);

}  // namespace mbsopt
