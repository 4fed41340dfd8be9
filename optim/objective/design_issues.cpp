#include "optim/objective/design_issues.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/cvodes/cvodes.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/objective/objective.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/solver/nlopt_methods.hpp"

namespace mbsopt::inline optim {

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

namespace {

void append(std::vector<DesignIssue>&& more, std::vector<DesignIssue>& issues) {
  std::ranges::move(more, std::back_inserter(issues));
}

std::vector<DesignIssue> least_squares_issues(const DesignSpec& spec, const std::string& path) {
  std::vector<DesignIssue> issues;
  const OptimizerSpec& optimizer = spec.optimizer;
  if (spec.over == "max")
    issues.push_back({path + ".type", "is 'least_squares', which minimises sums over the cases, not their maximum"});
  for (const auto& [key, given] :
       {std::pair("hessian", optimizer.hessian != "lbfgs"),
        std::pair("lbfgs_history", optimizer.lbfgs_history.has_value()), std::pair("warm_start", optimizer.warm_start)})
    if (given) issues.push_back({path + "." + key, "is for other optimisers; 'least_squares' does not use it"});
  return issues;
}

std::vector<DesignIssue> history_issues(const OptimizerSpec& optimizer, const NloptMethod* method,
                                        const std::string& path) {
  constexpr long kMostPairs = 1000;  // a run of a design takes fewer iterations
  std::vector<DesignIssue> issues;
  if (method && !keeps_pairs(*method))
    issues.push_back({path, "is given, but '" + optimizer.type + "' keeps no pairs; ipopt, lbfgs and mlsl do"});
  if (!method && optimizer.hessian != "lbfgs")
    issues.push_back({path, "is given, but hessian is '" + optimizer.hessian + "', which keeps no pairs"});
  if (*optimizer.lbfgs_history > kMostPairs)
    issues.push_back({path, "is " + std::to_string(*optimizer.lbfgs_history) + ", at most " +
                                std::to_string(kMostPairs) + " is allowed"});
  return issues;
}

std::vector<DesignIssue> branch_issues(const Scene& scene) {
  std::vector<DesignIssue> issues;
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    if (joint.type == "rack_pinion" || joint.type == "screw" || (joint.type == "gear" && !joint.ratio.is_number()))
      issues.push_back({child_path("joints", i), "is a " + joint.type +
                                                     ", which begins at the poses in the file; other assembly modes "
                                                     "have other poses, so design.multistart.branches must be "
                                                     "\"guess\""});
  }
  return issues;
}

}  // namespace

std::vector<DesignIssue> optimizer_issues(const DesignSpec& spec, const Scene& scene) {
  const OptimizerSpec& optimizer = spec.optimizer;
  const std::string path = "design.optimizer";
  std::vector<DesignIssue> issues;
  const NloptMethod* const method = find_nlopt_method(optimizer.type);
  if (optimizer.type == OptimizerSpec::kLeastSquares) append(least_squares_issues(spec, path), issues);
  if (method && optimizer.hessian != "lbfgs")
    issues.push_back({path + ".hessian", "is for ipopt only; '" + optimizer.type + "' builds its own, if any"});
  if (!method && optimizer.hessian != "lbfgs" && is_cvodes(scene.simulation.integrator.type))
    issues.push_back({path + ".hessian", "is '" + optimizer.hessian +
                                             "', which needs a run on given steps; simulation.integrator.type is '" +
                                             scene.simulation.integrator.type + "', which cannot take them: 'lbfgs'"});
  if (optimizer.lbfgs_history) append(history_issues(optimizer, method, path + ".lbfgs_history"), issues);
  if (method && optimizer.warm_start)
    issues.push_back({path + ".warm_start", "is for ipopt only, whose barrier leads away from the start; '" +
                                                optimizer.type + "' has none and begins at the given values"});
  if (!method && optimizer.warm_start && spec.multistart)
    issues.push_back({path + ".warm_start",
                      "says that the given values are near the solution, but the other starts of design.multistart are "
                      "not; leave out one of the two"});
  if (optimizer.seed && !(method && method->random))
    issues.push_back({path + ".seed", "is given, but '" + optimizer.type + "' draws no random numbers"});
  if (method) {
    const auto is_equality = [](const ObjectiveBound& b) { return b.lower && b.upper && *b.lower == *b.upper; };
    const NloptNeeds needs{spec.variables.size(), !spec.subject_to.empty(),
                           std::any_of(spec.subject_to.begin(), spec.subject_to.end(), is_equality)};
    if (const std::string refusal = nlopt_refusal(*method, needs); !refusal.empty())
      issues.push_back({path + ".type", refusal});
    if (method->global)
      append(missing_bounds(spec.variables, scene, path + ".type '" + optimizer.type + "' searches between them"),
             issues);
  }
  if (spec.multistart && spec.multistart->all_branches) append(branch_issues(scene), issues);
  if (spec.multistart)
    append(missing_bounds(spec.variables, scene, "design.multistart draws starts between them"), issues);
  if (spec.multistart) append(starts_issues(*spec.multistart, "design.multistart"), issues);
  return issues;
}

std::vector<DesignIssue> starts_issues(const MultistartSpec& spec, const std::string& path) {
  constexpr int kMost = 1'000'000;  // a start takes a process, 1 ms at least, and 1 kB for its record
  if (spec.starts <= kMost) return {};
  return {{path + ".starts",
           fmt::format("is {}, at most {} are possible: each is a search in its own process", spec.starts, kMost)}};
}

namespace {

// Least squares computes limits with the residuals, at instants of the same run.
std::optional<DesignIssue> limit_of_squares_issue(const Problem& problem) {
  const std::vector<ObjectiveBound>& bounds = problem.design->subject_to;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const auto objective = std::ranges::find(problem.objectives, bounds[i].objective, &ObjectiveSpec::name);
    if (bounds[i].sampled || (objective == problem.objectives.end() && !bounded_mean(bounds[i]))) continue;
    const bool has_samples_alone = objective != problem.objectives.end() && !objective->samples.empty() &&
                                   !objective->running && !objective->terminal && !objective->parameters_only &&
                                   objective->track.empty();
    if (!has_samples_alone)
      return DesignIssue{child_path("design.subject_to", i),
                         "bounds " + (bounds[i].objective.empty() ? "a mean" : "'" + bounds[i].objective + "'") +
                             ", which is not made of `samples` alone; the optimizer 'least_squares' takes no other "
                             "limits, ipopt with \"hessian\": \"gauss_newton\" does"};
  }
  return std::nullopt;
}

}  // namespace

std::optional<DesignIssue> curvature_issue(const Problem& problem) {
  const auto is_unread = [](const TrackTerm& term) { return !term.curve; };  // a finding of the reader says why
  if (problem.design && std::ranges::any_of(problem.objectives, [&](const ObjectiveSpec& objective) {
        return std::ranges::any_of(objective.track, is_unread);
      }))
    return std::nullopt;
  if (problem.design && problem.design->optimizer.type == OptimizerSpec::kLeastSquares)
    if (const std::optional<DesignIssue> issue = limit_of_squares_issue(problem)) return issue;
  if (problem.design && problem.design->optimizer.type == OptimizerSpec::kLeastSquares &&
      !objectives_of(problem, {problem.design->minimize}).front().is_sum_of_squares())
    return DesignIssue{"design.optimizer.type", "is 'least_squares', but '" + problem.design->minimize +
                                                    "' is not a sum of squares: it may have `track` alone; take ipopt"};
  if (!problem.design || problem.design->optimizer.hessian != "gauss_newton") return std::nullopt;
  const std::string& name = problem.design->minimize;
  const Objective objective = objectives_of(problem, {name}).front();
  if (objective.free_instants())
    return DesignIssue{"design.optimizer.hessian", "is 'gauss_newton', but '" + name +
                                                       "' tracks points of free timing; take the optimizer "
                                                       "'least_squares', or 'lbfgs' or 'exact'"};
  if (!objective.is_linear() && !objective.is_eigenvalue()) return std::nullopt;
  return DesignIssue{
      "design.optimizer.hessian",
      "is 'gauss_newton', but '" + name +
          "' is linear in its sensors and parameters or an eigenvalue; Gauss-Newton neglects all its second "
          "derivatives and is meant for squares (running, samples, rms_of) and extremes: take 'lbfgs' or 'exact'"};
}

}  // namespace mbsopt::inline optim
