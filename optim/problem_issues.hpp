// What is wrong with a whole problem: its scene, and what is asked of it.
#pragma once

#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem.hpp"

namespace mbsopt {

// Scene issues come first. Unused parameters (unused_parameters.hpp) are looked for only where nothing else is wrong.
std::vector<SceneIssue> find_issues(const Problem& problem);

}  // namespace mbsopt
