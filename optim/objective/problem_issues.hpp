// The findings on a whole problem: its scene, and what is asked of it.
#pragma once

#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// Without unused parameters, which are looked for where nothing else is wrong: unused_parameters.hpp.
std::vector<SceneIssue> find_issues(const Problem& problem);

}  // namespace mbsopt
