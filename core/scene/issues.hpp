// The findings on a scene: all checks of its plain data, at the values of its parameters.
#pragma once

#include <vector>

#include "core/scene/scene.hpp"
#include "core/scene/scene_issue.hpp"

namespace mbsopt {

// Returns nothing (or warnings only) if a Mechanism can be built.
std::vector<SceneIssue> find_issues(const Scene& scene);

std::vector<SceneIssue> without_repetitions(std::vector<SceneIssue> issues);

}  // namespace mbsopt
