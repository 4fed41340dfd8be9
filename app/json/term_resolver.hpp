// Gives the forces, costs and laws that a problem calls by name the terms in C++ that they stand for.
#pragma once

#include "app/json/findings.hpp"
#include "app/json/node.hpp"
#include "app/json/read_options.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// Loads the problem's plug-ins where this is allowed. Names that are unknown, parameters that are missing or too many,
// and numbers of bodies that differ are findings.
void resolve_terms(Problem& problem, const ReadOptions& options, const std::filesystem::path& folder, const Node& root,
                   Findings& findings);

}  // namespace mbsopt
