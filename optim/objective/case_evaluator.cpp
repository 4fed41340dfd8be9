#include "optim/objective/case_evaluator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "optim/machine/on_threads.hpp"
#include "optim/problem/load_cases.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline optim {

CaseEvaluator::CaseEvaluator(const Problem& problem, const std::vector<std::string>& objectives,
                             const std::vector<std::string>& variables, const EvaluatorOptions& options, int threads)
    : problem_(problem), progress_(std::make_shared<std::mutex>()), threads_(threads) {
  EvaluatorOptions of_case = options;
  if (options.progress && threads > 1 && problem.cases.size() > 1)
    of_case.progress = [lock = progress_, progress = options.progress](double t) {
      const std::lock_guard guard(*lock);
      return progress(t);
    };
  const std::vector<Problem> problems = problems_of_cases(problem);
  for (std::size_t c = 0; c < problems.size(); ++c) {
    Problem needed = options.user_forces.empty() ? what_objectives_need(problems[c]) : problems[c];
    std::vector<std::string> names = variables;
    if (!problem.cases.empty()) {
      for (std::string& name : names) name = name_in(problem.cases[c], name, problem.scene);
      // A variable may have an effect in another case only.
      for (Parameter& p : needed.scene.parameters) p.allow_unused = true;
    }
    const std::vector<Objective> all = objectives_of(needed, objectives);
    evaluators_.emplace_back(std::move(needed.scene), all, names, of_case);
  }
}

std::string CaseEvaluator::in_case(std::size_t c, const std::string& what) const {
  if (!has_cases()) return what;
  const CaseSpec& load_case = problem_.cases[c];
  return fmt::format("{} ({})", in_names_of_problem(what, load_case, problem_.scene), load_case.name);
}

std::string CaseEvaluator::with_case(std::size_t c, const std::string& words) const {
  const CaseSpec& load_case = problem_.cases[c];
  return fmt::format("case '{}': {}", load_case.name, in_names_of_problem(words, load_case, problem_.scene));
}

long CaseEvaluator::simulations() const {
  long sum = 0;
  for (const Evaluator& evaluator : evaluators_) sum += evaluator.simulations();
  return sum;
}

void CaseEvaluator::for_each_case(const std::function<void(std::size_t c)>& work) const {
  std::vector<std::size_t> order(cases());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (last_.of_cases.size() == order.size())
    std::ranges::stable_sort(order, std::greater(),
                             [&](std::size_t c) { return last_.of_cases[c].statistics.rhs_evaluations; });
  on_threads(order.size(), threads_, [&](std::size_t i) { work(order[i]); });
}

template <class Evaluate>
CaseEvaluation CaseEvaluator::evaluated(const Eigen::VectorXd& rho, const Evaluate& evaluate) {
  std::vector<Evaluation> found(cases());
  for_each_case([&](std::size_t c) { found[c] = evaluate(evaluators_[c]); });
  const Eigen::Index n = static_cast<Eigen::Index>(objectives());
  CaseEvaluation all;
  static_cast<Evaluation&>(all) = found[0];
  all.rho = rho;
  if (has_cases()) {
    const Eigen::Index rows = n * static_cast<Eigen::Index>(cases()), columns = found[0].psi_rho.cols();
    all.psi.setZero(rows), all.psi_rho.setZero(found[0].has_gradients() ? rows : 0, columns);
    all.simulations = 0, all.wall_seconds = 0, all.warnings.clear();
  }
  for (std::size_t c = 0; c < cases() && has_cases(); ++c) {
    const Evaluation& e = found[c];
    all.simulations += e.simulations, all.wall_seconds += e.wall_seconds;
    for (const std::string& warning : e.warnings) all.warnings.push_back(with_case(c, warning));
    if (!e.ok) {
      if (all.ok || c == 0) all.message = with_case(c, e.message);
      all.ok = false;
      continue;
    }
    const Eigen::Index first = n * static_cast<Eigen::Index>(c);
    all.psi.segment(first, n) = e.psi;
    if (all.has_gradients() && e.has_gradients()) all.psi_rho.middleRows(first, n) = e.psi_rho;
  }
  all.of_cases = std::move(found);
  last_ = std::move(all);
  return last_;
}

CaseEvaluation CaseEvaluator::values(const Eigen::VectorXd& rho) {
  return evaluated(rho, [&](Evaluator& evaluator) { return evaluator.values(rho); });
}

CaseEvaluation CaseEvaluator::gradients(const Eigen::VectorXd& rho) {
  return evaluated(rho, [&](Evaluator& evaluator) { return evaluator.gradients(rho); });
}

std::vector<std::optional<double>> CaseEvaluator::true_values(const Eigen::VectorXd& rho) const {
  std::vector<std::vector<std::optional<double>>> found(cases());
  for_each_case([&](std::size_t c) { found[c] = evaluators_[c].true_values(rho); });
  std::vector<std::optional<double>> all;
  for (const auto& of_case : found) all.insert(all.end(), of_case.begin(), of_case.end());
  return all;
}

}  // namespace mbsopt::inline optim
