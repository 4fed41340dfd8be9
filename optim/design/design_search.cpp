#include "optim/design/design_search.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <iterator>
#include <string>
#include <utility>

#include "core/simulate/simulation_warnings.hpp"
#include "optim/design/design_description.hpp"
#include "optim/design/design_program.hpp"
#include "optim/design/limit_rounds.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/gradient_doubts.hpp"
#include "optim/objective/integration_error.hpp"
#include "optim/solver/nlopt_methods.hpp"

namespace mbsopt::inline optim {
namespace {

// Compares the derivatives of all objectives of an evaluator with differences.
DifferenceComparison comparison_at(const Evaluation& start, const Evaluator& evaluator) {
  DifferenceComparison comparison;
  for (Eigen::Index k = 0; k < start.psi_rho.cols(); ++k) {
    Parameter p = evaluator.variable(k);
    p.value = start.rho(evaluator.variables()[static_cast<std::size_t>(k)]);
    comparison.variables.push_back(compared_variable(p.name, p));
  }
  for (const Objective& objective : evaluator.objectives())
    comparison.groups.push_back(
        {"objective '" + objective.name() + "'", static_cast<Eigen::Index>(comparison.groups.size()), 1});
  comparison.f = start.psi;
  comparison.f_rho = start.psi_rho;
  // One evaluator for all differences, which keeps its last point: threads stays 1.
  comparison.at = [&start, there = evaluator](std::size_t k, double h) mutable -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd rho = start.rho;
    rho(there.variables()[k]) += h;
    const Evaluation e = there.values(rho);
    if (!e.ok) return std::nullopt;
    return e.psi;
  };
  comparison.tighter = [&start, &evaluator]() -> std::optional<Eigen::VectorXd> {
    std::optional<Scene> tight = with_other_tolerances(evaluator.scene(), start.statistics.steps);
    if (!tight) return std::nullopt;
    const Evaluation e = evaluator.in(*std::move(tight), evaluator.options().method).gradients(start.rho);
    if (!e.ok) return std::nullopt;
    return e.psi;
  };
  return comparison;
}

// Warnings of derivatives at the start that disagree with differences, in each load case. go_on is asked before every
// difference, in any thread.
std::vector<std::string> difference_warnings(const Evaluation& start, const Evaluator& evaluator,
                                             const std::function<bool()>& go_on) {
  std::vector<std::vector<std::string>> of_cases(evaluator.cases());
  evaluator.for_each_case([&](std::size_t c) {
    of_cases[c] = gradient_doubts(evaluator.of_case(c), start.of_case(c));
    DifferenceComparison comparison = comparison_at(start.of_case(c), evaluator.of_case(c));
    comparison.go_on = go_on;
    std::ranges::move(comparison.warnings(), std::back_inserter(of_cases[c]));
  });
  std::vector<std::string> warnings;
  for (std::size_t c = 0; c < of_cases.size(); ++c)
    for (const std::string& warning : of_cases[c])
      warnings.push_back("design.variables: " + evaluator.in_case(c, warning));
  return warnings;
}

class SingleDesign {
 public:
  SingleDesign(const Problem& problem, const DesignOptions& options)
      : options_(options), program_(problem, until_abandoned(), [this] { return abandoned_.load(); }) {}

  DesignResult run() {
    begin();
    search();
    if (start_.ok && rounds_.solution.point.ok) describe_last_point();
    add_warnings();
    result_.simulations += simulations();
    result_.wall_seconds = stopwatch_.seconds();
    return std::move(result_);
  }

 private:
  DesignOptions until_abandoned() {
    DesignOptions options = options_;
    if (options_.simulation_progress)
      options.simulation_progress = [this](double t) {
        if (!is_describing_) abandoned_ = abandoned_ || !options_.simulation_progress(t);
        return is_describing_ || !abandoned_;
      };
    return options;
  }
  long simulations() const { return program_.evaluator().simulations() + program_.hessian_gradients(); }

  void begin() {
    result_.optimizer = program_.spec().optimizer.chosen();
    start_ = program_.start_from(program_.x_start(), options_.scale);
    result_.scale = program_.scale();
    result_.gradient_choice = start_.choice.empty() ? std::string(to_string(start_.method)) : start_.choice;
    describe_start(program_, start_, result_);
    if (!start_.ok || !options_.compare_differences) return;
    std::ranges::move(difference_warnings(start_, program_.evaluator(), [this] { return !abandoned_; }),
                      std::back_inserter(result_.warnings));
  }

  void search() {
    const auto progress = [this](const NlpProgress& p) {
      if (abandoned_) return false;  // the iterate before the one that was not reached
      result_.history.push_back({p.iteration, p.f, p.violation, p.optimality, program_.scaling().to_rho(p.x),
                                 result_.simulations + simulations()});
      return !options_.progress || options_.progress(result_.history.back());
    };
    rounds_ = solve_in_rounds(program_, {progress, [this] { return abandoned_.load(); }}, result_);
    static_cast<SolverOutcome&>(result_) = rounds_.solution;
    if (abandoned_) result_.end_on_request();
    result_.algorithm = rounds_.solution.algorithm;
    result_.rho = program_.rho_at(result_.x);
  }

  // The scene with the poses that the search has followed, if its own lead to others.
  void describe_poses() {
    if (!program_.evaluator().has_left_guess(result_.rho)) return;
    std::vector<Body> bodies = program_.problem().scene.bodies;
    for (const Body& followed : program_.evaluator().of_case(0).scene().bodies)
      for (Body& body : bodies)
        if (body.name == followed.name) body = followed;
    result_.mode = DesignMode{0, 0, std::move(bodies)};
  }

  // The end point of a stopped search is evaluated as well; nothing abandons that.
  void describe_last_point() {
    describe_end(program_, rounds_.solution, result_);
    describe_poses();
    if (abandoned_ && !options_.evaluate_stopped) return;
    is_describing_ = true;
    if (abandoned_ || rounds_.true_values.empty()) rounds_.true_values = program_.evaluator().true_values(result_.rho);
    describe_solution(program_, rounds_, result_);
    if (!abandoned_) judge_solution(program_, result_);
  }

  void add_warnings() {
    const auto jumps = [](const Jump& jump) { return jump.size != 0; };
    if (std::ranges::none_of(result_.final_evaluation.statistics.jumps, jumps))  // those of the solution beside it
      for (const Jump& jump : start_.statistics.jumps)
        if (jumps(jump)) result_.warnings.push_back("at the start, " + in_words(program_.evaluator().scene(), jump));
    if (!program_.hessian_failure().empty())
      result_.warnings.push_back(
          "design.optimizer.hessian: could not be computed everywhere, where it was not the one "
          "before served again; first: " +
          program_.hessian_failure());
  }

  const Stopwatch stopwatch_;
  const DesignOptions& options_;
  std::atomic<bool> abandoned_ = false, is_describing_ = false;  // read by the threads of all cases
  DesignProgram program_;
  DesignResult result_;
  Evaluation start_;
  LimitedSolution rounds_;
};

}  // namespace

namespace {

// Leaves the next optimiser what the first one has not spent. Returns false if that is nothing.
bool take_off(const DesignResult& spent, OptimizerSpec& spec) {
  if (spec.max_iterations) *spec.max_iterations -= spent.iterations;
  if (spec.max_evaluations) *spec.max_evaluations -= spent.evaluations;
  return spec.max_iterations.value_or(1) > 0 && spec.max_evaluations.value_or(1) > 0;
}

}  // namespace

// Where sqp finds no point near that satisfies the limits, Ipopt on smooth extremes may come to another valley from the
// same start. Where another local method stalls, or does not reach the limits, sqp goes on from its end.
DesignResult single_design(const Problem& problem, const DesignOptions& options) {
  DesignResult result = SingleDesign(problem, options).run();
  const OptimizerSpec& spec = problem.design->optimizer;
  const bool stalled = result.status == SolverStatus::no_progress && !spec.is_sqp();
  Problem again = problem;
  OptimizerSpec& next = again.design->optimizer = {};
  next.type = spec.is_sqp() ? "ipopt" : "sqp";
  next.tolerance = spec.tolerance;
  next.max_iterations = spec.max_iterations;
  next.max_evaluations = spec.max_evaluations;
  const NloptMethod* const method = find_nlopt_method(spec.type);
  if ((result.status != SolverStatus::infeasible && !stalled) || spec.type == "sqp" || (method && method->global) ||
      !take_off(result, next))
    return result;
  DesignOptions without_comparison = options;
  without_comparison.compare_differences = false;
  if (!spec.is_sqp())
    for (std::size_t p = 0; p < again.scene.parameters.size(); ++p)
      again.scene.parameters[p].value = result.rho(static_cast<Eigen::Index>(p));
  DesignResult other = SingleDesign(again, without_comparison).run();
  if (!other.ok() || (stalled && other.status != SolverStatus::converged)) {
    result.iterations += other.iterations;
    result.evaluations += other.evaluations;
    result.failed_evaluations += other.failed_evaluations;
    result.simulations += other.simulations;
    result.wall_seconds += other.wall_seconds;
    if (other.status == SolverStatus::stopped) result.end(other.status, other.message);
    return result;
  }
  other.add_work_of(result);
  other.prepend(std::move(result.history));
  return other;
}

}  // namespace mbsopt::inline optim
