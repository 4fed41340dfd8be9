#include "optim/design_issues.hpp"

#include <algorithm>

#include "core/scene/scene_path.hpp"
#include "optim/nlopt_methods.hpp"

namespace mbsopt {

std::vector<DesignIssue> missing_bounds(const std::vector<std::string>& variables, const Scene& scene,
                                        const std::string& by) {
  std::vector<DesignIssue> issues;
  for (const Parameter& p : scene.parameters) {
    if (std::find(variables.begin(), variables.end(), p.name) == variables.end() || (p.lower && p.upper)) continue;
    const char* const missing = p.lower ? "no upper bound" : p.upper ? "no lower bound" : "no bounds";
    issues.push_back({child_path("parameters", p.name), std::string("has ") + missing + "; both are needed: " + by});
  }
  return issues;
}

std::vector<DesignIssue> optimizer_issues(const DesignSpec& spec, const Scene& scene) {
  const OptimizerSpec& optimizer = spec.optimizer;
  const std::string path = "design.optimizer";
  std::vector<DesignIssue> issues;
  const NloptMethod* const method = find_nlopt_method(optimizer.type);
  if (method && optimizer.hessian != "lbfgs")
    issues.push_back({path + ".hessian", "is of ipopt only; '" + optimizer.type + "' builds its own, if any"});
  if (optimizer.seed && !(method && method->random))
    issues.push_back({path + ".seed", "is given, but '" + optimizer.type + "' draws no random numbers"});
  if (method) {
    const auto is_equality = [](const ObjectiveBound& b) { return b.lower && b.upper && *b.lower == *b.upper; };
    const NloptNeeds needs{spec.variables.size(), !spec.subject_to.empty(),
                           std::any_of(spec.subject_to.begin(), spec.subject_to.end(), is_equality)};
    if (const std::string refusal = nlopt_refusal(*method, needs); !refusal.empty())
      issues.push_back({path + ".type", refusal});
    if (method->global) {
      for (DesignIssue& issue :
           missing_bounds(spec.variables, scene, path + ".type '" + optimizer.type + "' searches between them"))
        issues.push_back(std::move(issue));
    }
  }
  if (spec.multistart) {
    for (DesignIssue& issue : missing_bounds(spec.variables, scene, "design.multistart draws starts between them"))
      issues.push_back(std::move(issue));
  }
  return issues;
}

}  // namespace mbsopt
