// Requests of a design that its optimiser cannot satisfy, at their place in the problem.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene_issue.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// Reports what the optimiser cannot use or lacks.
std::vector<SceneIssue> optimizer_issues(const DesignSpec& spec, const Scene& scene);

// Reports Gauss-Newton or least squares for an objective without their curvature. The problem must have no other error.
std::optional<SceneIssue> curvature_issue(const Problem& problem);

// Starts between bounds need both bounds of each variable, and no more of them than any machine runs. path: of the
// multistart.
std::vector<SceneIssue> starts_issues(const MultistartSpec& spec, const std::vector<std::string>& variables,
                                      const Scene& scene, const std::string& path);

}  // namespace mbsopt::inline optim
