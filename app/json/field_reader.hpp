// The visitor that fills a problem from nodes (core/scene/vocabulary.hpp lists the fields). It checks shapes and
// syntax; other checks on the finished problem find wrong meanings.
#pragma once

#include "app/json/findings.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

// Adds findings to those of `root`.
void read_fields(const PlacedNode& root, Problem& problem);

}  // namespace mbsopt::inline app
