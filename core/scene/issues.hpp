// The findings on a scene: everything that can be said from its plain data, at the values of its parameters.
#pragma once

#include <vector>

#include "core/scene/scene.hpp"
#include "core/scene/scene_issue.hpp"

namespace mbsopt {

// Empty (or warnings only) where a Mechanism can be built.
std::vector<SceneIssue> find_issues(const Scene& scene);

std::vector<SceneIssue> without_repetitions(std::vector<SceneIssue> issues);

}  // namespace mbsopt
