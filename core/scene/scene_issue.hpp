// An error or a warning about a scene or a problem.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace mbsopt {

struct SceneIssue {
  std::string path;     // JSON path: "bodies[2].inertia"
  std::string message;  // the finding, and the allowed values
  bool is_warning = false;
  std::optional<std::size_t> offset = {};  // byte in the text of the expression that is wrong
  bool operator==(const SceneIssue&) const = default;
};

}  // namespace mbsopt
