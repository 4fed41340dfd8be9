#include "optim/objective/design_issues.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/cvodes/cvodes.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/objective/objective.hpp"
#include "optim/solver/nlopt_methods.hpp"

namespace mbsopt::inline optim {

namespace {

// A start between bounds needs both bounds. `by` is the field that samples them, with its place.
void add_missing_bounds(const std::vector<std::string>& variables, const Scene& scene, const std::string& by,
                        std::vector<SceneIssue>& issues) {
  for (const Parameter& p : scene.parameters) {
    if (std::ranges::find(variables, p.name) == variables.end() || (p.lower && p.upper)) continue;
    const char* const missing = p.lower ? "no upper bound" : p.upper ? "no lower bound" : "no bounds";
    issues.push_back({child_path("parameters", p.name), std::string("has ") + missing + "; both are needed: " + by});
  }
}

// Other assembly modes have other poses.
void add_branches(const Scene& scene, std::vector<SceneIssue>& issues) {
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    if (joint.type == "rack_pinion" || joint.type == "screw" || (joint.type == "gear" && !joint.ratio.is_number()))
      issues.push_back({child_path("joints", i), "is a " + joint.type +
                                                     ", which begins at the poses in the file; other assembly modes "
                                                     "have other poses, so design.multistart.branches must be "
                                                     "\"guess\""});
  }
}

}  // namespace

std::vector<SceneIssue> optimizer_issues(const DesignSpec& spec, const Scene& scene) {
  constexpr long kMostPairs = 1000;  // a run of a design takes fewer iterations
  const OptimizerSpec& optimizer = spec.optimizer;
  const std::string &type = optimizer.type, &hessian = optimizer.hessian,
                    &integrator = scene.simulation.integrator.type;
  const NloptMethod* const method = find_nlopt_method(type);
  std::vector<SceneIssue> issues;
  // Reports a field of the optimiser.
  const auto report = [&](bool wrong, const char* key, const std::string& message) {
    if (wrong) issues.push_back({std::string("design.optimizer.") + key, message});
  };
  if (type == OptimizerSpec::kLeastSquares) {
    constexpr const char* kUnused = "is for other optimisers; 'least_squares' does not use it";
    report(spec.over == "max", "type", "is 'least_squares', which minimises sums over the cases, not their maximum");
    report(hessian != "lbfgs", "hessian", kUnused);
    report(optimizer.lbfgs_history.has_value(), "lbfgs_history", kUnused);
    report(optimizer.warm_start, "warm_start", kUnused);
  }
  report(method && hessian != "lbfgs", "hessian", "is for ipopt only; '" + type + "' builds its own, if any");
  report(!method && hessian != "lbfgs" && is_cvodes(integrator), "hessian",
         "is '" + hessian + "', which needs a run on given steps; simulation.integrator.type is '" + integrator +
             "', which cannot take them: 'lbfgs'");
  if (const std::optional<long>& pairs = optimizer.lbfgs_history) {
    report(method && !keeps_pairs(*method), "lbfgs_history",
           "is given, but '" + type + "' keeps no pairs; ipopt, lbfgs and mlsl do");
    report(!method && hessian != "lbfgs", "lbfgs_history",
           "is given, but hessian is '" + hessian + "', which keeps no pairs");
    report(*pairs > kMostPairs, "lbfgs_history", fmt::format("is {}, at most {} is allowed", *pairs, kMostPairs));
  }
  report(method && optimizer.warm_start, "warm_start",
         "is for ipopt only, whose barrier leads away from the start; '" + type +
             "' has none and begins at the given values");
  report(!method && optimizer.warm_start && spec.multistart, "warm_start",
         "says that the given values are near the solution, but the other starts of design.multistart are not; leave "
         "out one of the two");
  report(optimizer.seed && !(method && method->random), "seed", "is given, but '" + type + "' draws no random numbers");
  if (method) {
    const NloptNeeds needs{spec.variables.size(), !spec.subject_to.empty(),
                           std::ranges::any_of(spec.subject_to, is_equality<ObjectiveBound>)};
    const std::string refusal = nlopt_refusal(*method, needs);
    report(!refusal.empty(), "type", refusal);
    if (method->global)
      add_missing_bounds(spec.variables, scene, "design.optimizer.type '" + type + "' searches between them", issues);
  }
  if (!spec.multistart) return issues;
  if (spec.multistart->all_branches) add_branches(scene, issues);
  std::ranges::move(starts_issues(*spec.multistart, spec.variables, scene, "design.multistart"),
                    std::back_inserter(issues));
  return issues;
}

std::vector<SceneIssue> starts_issues(const MultistartSpec& spec, const std::vector<std::string>& variables,
                                      const Scene& scene, const std::string& path) {
  constexpr int kMost = 1'000'000;  // a start takes a process, 1 ms at least, and 1 kB for its record
  std::vector<SceneIssue> issues;
  add_missing_bounds(variables, scene, path + " draws starts between them", issues);
  if (spec.starts > kMost)
    issues.push_back(
        {path + ".starts",
         fmt::format("is {}, at most {} are possible: each is a search in its own process", spec.starts, kMost)});
  return issues;
}

std::optional<SceneIssue> curvature_issue(const Problem& problem) {
  if (!problem.design) return std::nullopt;
  const DesignSpec& design = *problem.design;
  const bool squares = design.optimizer.type == OptimizerSpec::kLeastSquares,
             gauss_newton = design.optimizer.hessian == "gauss_newton";
  const auto is_unread = [](const TrackTerm& term) { return !term.curve; };  // a finding of the reader says why
  for (const ObjectiveSpec& objective : problem.objectives)
    if (std::ranges::any_of(objective.track, is_unread)) return std::nullopt;
  if (squares && (design.minimize.empty() || !objectives_of(problem, {design.minimize}).front().is_sum_of_squares()))
    return SceneIssue{"design.optimizer.type", "is 'least_squares', but '" + design.name() +
                                                   "' is not a sum of squares: it may have `track` alone; take ipopt"};
  if (!gauss_newton) return std::nullopt;
  const auto issue = [](const std::string& words) {
    return SceneIssue{"design.optimizer.hessian", "is 'gauss_newton', " + words};
  };
  const std::string& name = design.minimize;
  if (name.empty()) return issue("which is for one objective that is minimised: take 'lbfgs' or 'exact'");
  const Objective objective = objectives_of(problem, {name}).front();
  if (objective.free_instants())
    return issue("but '" + name +
                 "' tracks points of free timing; take the optimizer 'least_squares', or 'lbfgs' or 'exact'");
  if (!objective.is_linear() && !objective.is_of_linear_motion()) return std::nullopt;
  return issue("but '" + name +
               "' is linear in its sensors and parameters, an eigenvalue or a response; Gauss-Newton neglects all its "
               "second derivatives and is meant for squares (running, samples, rms_of) and extremes: take 'lbfgs' or "
               "'exact'");
}

}  // namespace mbsopt::inline optim
