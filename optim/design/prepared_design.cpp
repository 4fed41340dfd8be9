#include "optim/design/prepared_design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "optim/objective/design_issues.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/solver/nlopt_solver.hpp"

namespace mbsopt::inline optim {
namespace {

const DesignSpec& checked(const Problem& problem) {
  if (!problem.design) throw std::invalid_argument("design: is missing; it says what to minimise and what to vary");
  const DesignSpec& spec = *problem.design;
  if (spec.variables.empty()) throw std::invalid_argument("design.variables: is empty; name at least one parameter");
  const bool is_known = spec.optimizer.type == "ipopt" || spec.optimizer.type == OptimizerSpec::kLeastSquares ||
                        find_nlopt_method(spec.optimizer.type);
  if (!is_known)
    throw std::invalid_argument(fmt::format("design.optimizer.type: is '{}'; available: ipopt {} {}",
                                            spec.optimizer.type, OptimizerSpec::kLeastSquares, nlopt_method_names()));
  for (std::size_t i = 0; i < spec.subject_to.size(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[i];
    if (!bound.lower && !bound.upper)
      throw std::invalid_argument(fmt::format("design.subject_to[{}]: gives neither lower nor upper", i));
    if (bound.lower && bound.upper && *bound.lower > *bound.upper)
      throw std::invalid_argument(
          fmt::format("design.subject_to[{}]: lower is {}, above upper {}", i, *bound.lower, *bound.upper));
  }
  if (const std::vector<SceneIssue> issues = optimizer_issues(spec, problem.scene); !issues.empty())
    throw std::invalid_argument(issues[0].path + ": " + issues[0].message);
  if (const std::optional<SceneIssue> issue = curvature_issue(problem))
    throw std::invalid_argument(issue->path + ": " + issue->message);
  return spec;
}

Eigen::VectorXd start_of(const CaseEvaluator& evaluator, const VariableScaling& scaling) {
  Eigen::VectorXd designed(scaling.size());
  for (Eigen::Index k = 0; k < designed.size(); ++k)
    designed(k) = evaluator.start()(evaluator.variables()[static_cast<std::size_t>(k)]);
  return scaling.to_x(designed);
}

Problem with_named_means(Problem problem) {
  name_bounded_means(problem);
  return problem;
}

EvaluatorOptions evaluator_options(const DesignOptions& options, std::function<bool(double t)> progress) {
  EvaluatorOptions result;
  result.method = options.method, result.user_forces = options.user_forces, result.progress = std::move(progress);
  return result;
}

}  // namespace

std::vector<Parameter> chosen(const Scene& scene, const std::vector<int>& indices) {
  std::vector<Parameter> parameters;
  for (const int k : indices) parameters.push_back(scene.parameters[static_cast<std::size_t>(k)]);
  return parameters;
}

std::vector<std::string> objective_names(const DesignSpec& spec) {
  std::vector<std::string> names{spec.minimize};
  for (const ObjectiveBound& bound : spec.subject_to) names.push_back(bound.objective);
  return names;
}

PreparedDesign::PreparedDesign(const Problem& given, const DesignOptions& options,
                               std::function<bool(double t)> progress)
    : problem(with_named_means(given)),
      spec(checked(problem)),
      evaluator(problem, objective_names(spec), spec.variables, evaluator_options(options, std::move(progress)),
                options.threads),
      scaling(chosen(problem.scene, evaluator.variables()), felt_changes()),
      x_start(start_of(evaluator, scaling)) {
  if (!spec.sharpness) spec.sharpness = sharpness();
}

// Per variable the change d that alters an objective or a limit by its size:
//   |g| d + |h| d^2/2 = |psi|      g: slope at the start, h: its change along a short step of all these variables
// Empty if all values tell how large their variables are. Where h is not known, values tell that unless they are 0.
Eigen::VectorXd PreparedDesign::felt_changes() {
  constexpr double kShort = 1e-3, kShortOfRange = 1e-8;  // of the value; of a range, which may be far too wide
  const std::vector<Parameter> variables = chosen(problem.scene, evaluator.variables());
  if (std::ranges::none_of(variables, is_scaled_by_range)) return {};
  const CaseEvaluation start = evaluator.gradients(evaluator.start());
  if (!start.ok) return {};
  Eigen::VectorXd beside = evaluator.start();
  for (std::size_t k = 0; k < variables.size(); ++k) {
    const Parameter& p = variables[k];
    if (!is_scaled_by_range(p)) continue;
    const double of_range = p.lower && p.upper ? kShortOfRange * (*p.upper - *p.lower) : kShort;
    const double step = p.value != 0 ? kShort * std::abs(p.value) : of_range;
    beside(evaluator.variables()[k]) += p.upper && p.value + step > *p.upper ? -step : step;
  }
  const CaseEvaluation there = evaluator.gradients(beside);
  Eigen::VectorXd felt(start.psi_rho.cols());
  for (Eigen::Index k = 0; k < felt.size(); ++k) {
    const int index = evaluator.variables()[static_cast<std::size_t>(k)];
    const double step = beside(index) - start.rho(index);
    felt(k) = there.ok || start.rho(index) == 0 ? std::numeric_limits<double>::infinity() : 0;
    for (Eigen::Index i = 0; i < start.psi.size(); ++i) {
      const double size = std::abs(start.psi(i)), g = std::abs(start.psi_rho(i, k));
      const double h = there.ok && step != 0 ? std::abs((there.psi_rho(i, k) - start.psi_rho(i, k)) / step) : 0;
      if (size > 0 && g + h > 0) felt(k) = std::min(felt(k), 2 * size / (g + std::sqrt(g * g + 2 * h * size)));
    }
  }
  return felt;
}

// The sharpness of the maximum over cases is relative to the largest value at the start.
std::optional<double> PreparedDesign::sharpness() {
  if (spec.over != "max" || problem.cases.size() < 2) return std::nullopt;
  const CaseEvaluation& start = evaluator.gradients(evaluator.start());
  double largest = 0;
  for (std::size_t c = 0; c < problem.cases.size() && start.ok; ++c)
    largest = std::max(largest, std::abs(problem.cases[c].weight * start.of_cases[c].psi(0)));
  return DesignSpec::kSharpness / (largest > 0 ? largest : 1);
}

}  // namespace mbsopt::inline optim
