// Assigns the C++ terms to the forces, costs and laws that a problem calls by name.
#pragma once

#include "app/json/problem_source.hpp"

namespace mbsopt::inline app {

// Loads the problem's plug-ins if this is allowed. Findings are unknown names, missing or superfluous parameters, and
// wrong numbers of bodies.
void resolve_terms(Problem& problem, const ReadOptions& options, ProblemSource& source);

}  // namespace mbsopt::inline app
