// What is wrong with a scene: everything that can be said from its plain data, at the values of its parameters.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt {

struct SceneIssue {
  std::string path;     // JSON path: "bodies[2].inertia"
  std::string message;  // what was found, what is allowed
  bool is_warning = false;
  std::optional<std::size_t> offset = {};  // byte in the text of the expression that is wrong
  bool operator==(const SceneIssue&) const = default;
};

// Empty (or warnings only) where a Mechanism can be built.
std::vector<SceneIssue> find_issues(const Scene& scene);

std::vector<SceneIssue> without_repetitions(std::vector<SceneIssue> issues);

}  // namespace mbsopt
