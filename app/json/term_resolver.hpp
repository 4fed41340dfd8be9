// Assigns the C++ terms to the forces, costs and laws that a problem calls by name.
#pragma once

#include "app/json/findings.hpp"
#include "app/json/node.hpp"
#include "app/json/read_options.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

// Loads the problem's plug-ins if this is allowed. Findings are unknown names, missing or superfluous parameters, and
// wrong numbers of bodies.
void resolve_terms(Problem& problem, const ReadOptions& options, const std::filesystem::path& folder, const Node& root,
                   Findings& findings);

}  // namespace mbsopt::inline app
