// Requests of a design that its optimiser cannot meet, at the place where it is asked.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt {

struct DesignIssue {
  std::string path, message;
};

// The optimiser's type must be one there is, and variables parameters there are.
std::vector<DesignIssue> optimizer_issues(const DesignSpec& spec, const Scene& scene);

// Gauss-Newton asked for an objective that gives it no curvature. The problem must make sense otherwise.
std::optional<DesignIssue> curvature_issue(const Problem& problem);

// A start between bounds needs both. by: what samples them, with its place.
std::vector<DesignIssue> missing_bounds(const std::vector<std::string>& variables, const Scene& scene,
                                        const std::string& by);

}  // namespace mbsopt
