#include "optim/design/start_differences.hpp"

#include <memory>
#include <optional>
#include <utility>

#include "optim/differences/difference_comparison.hpp"
#include "optim/objective/gradient_doubts.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt::inline optim {
namespace {

// Compares the derivatives of all objectives of an evaluator.
DifferenceComparison comparison_at(const Evaluation& start, const Evaluator& evaluator) {
  DifferenceComparison comparison;
  const Scene& scene = evaluator.scene();
  for (const int k : evaluator.variables()) {
    Parameter p = scene.parameters[static_cast<std::size_t>(k)];
    p.value = start.rho(k);
    comparison.variables.push_back(compared_variable(p.name, p));
  }
  for (std::size_t i = 0; i < evaluator.objectives().size(); ++i)
    comparison.groups.push_back(
        {"objective '" + evaluator.objectives()[i].name() + "'", static_cast<Eigen::Index>(i), 1});
  comparison.f = start.psi, comparison.f_rho = start.psi_rho;
  std::vector<std::string> names;
  for (const ComparedVariable& v : comparison.variables) names.push_back(v.name);
  // One evaluator for all differences, which keeps its last point: threads stays 1.
  const auto there = std::make_shared<Evaluator>(scene, evaluator.objectives(), names, evaluator.options());
  comparison.at = [&start, &evaluator, there](std::size_t k, double h) -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd rho = start.rho;
    rho(evaluator.variables()[k]) += h;
    const Evaluation& e = there->values(rho);
    if (!e.ok) return std::nullopt;
    return e.psi;
  };
  comparison.tighter = [&start, &evaluator, &scene, names](Eigen::VectorXd& f, Eigen::MatrixXd& f_rho) {
    std::optional<Scene> tight = with_other_tolerances(scene, start.statistics.steps);
    if (!tight) return false;
    Evaluator at_tight(*std::move(tight), evaluator.objectives(), names, evaluator.options());
    const Evaluation& e = at_tight.gradients(start.rho);
    f = e.psi, f_rho = e.psi_rho;
    return e.ok;
  };
  return comparison;
}

}  // namespace

std::vector<std::string> difference_warnings(const CaseEvaluation& start, CaseEvaluator& evaluator,
                                             const std::function<bool()>& go_on) {
  std::vector<std::vector<std::string>> of_cases(evaluator.cases());
  evaluator.for_each_case([&](std::size_t c) {
    of_cases[c] = gradient_doubts(evaluator.of_case(c), start.of_cases[c]);
    DifferenceComparison comparison = comparison_at(start.of_cases[c], evaluator.of_case(c));
    comparison.go_on = go_on;
    for (std::string& warning : comparison.warnings()) of_cases[c].push_back(std::move(warning));
  });
  std::vector<std::string> warnings;
  for (std::size_t c = 0; c < of_cases.size(); ++c)
    for (const std::string& warning : of_cases[c])
      warnings.push_back("design.variables: " + evaluator.in_case(c, warning));
  return warnings;
}

}  // namespace mbsopt::inline optim
