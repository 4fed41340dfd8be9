// The findings on a whole problem: its scene, and the tasks on it.
#pragma once

#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// Unused parameters are not among them: unused_parameters.hpp finds these if there is no other error.
std::vector<SceneIssue> find_issues(const Problem& problem);

}  // namespace mbsopt::inline optim
