// Requests of a design that its optimiser cannot satisfy, at their place in the problem.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

struct DesignIssue {
  std::string path, message;
};

// Reports an unknown type of the optimiser, and variables that are no parameters.
std::vector<DesignIssue> optimizer_issues(const DesignSpec& spec, const Scene& scene);

// Reports Gauss-Newton for an objective without its curvature. The problem must have no other error.
std::optional<DesignIssue> curvature_issue(const Problem& problem);

// A start between bounds needs both bounds. `by` is the field that samples them, with its place.
std::vector<DesignIssue> missing_bounds(const std::vector<std::string>& variables, const Scene& scene,
                                        const std::string& by);

// Reports more starts than any machine runs. path: of the multistart.
std::vector<DesignIssue> starts_issues(const MultistartSpec& spec, const std::string& path);

}  // namespace mbsopt::inline optim
