#include "optim/design/single_design.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <string>
#include <utility>

#include "core/simulate/simulation_warnings.hpp"
#include "optim/design/design_description.hpp"
#include "optim/design/design_program.hpp"
#include "optim/design/limit_rounds.hpp"
#include "optim/design/prepared_design.hpp"
#include "optim/design/start_differences.hpp"
#include "optim/machine/stopwatch.hpp"

namespace mbsopt::inline optim {
namespace {

class SingleDesign {
 public:
  SingleDesign(const Problem& problem, const DesignOptions& options)
      : options_(options),
        prepared_(problem, options, until_abandoned()),
        program_(prepared_.spec, prepared_.evaluator, prepared_.scaling, prepared_.objective(),
                 [this] { return abandoned_.load(); }) {}

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
  std::function<bool(double t)> until_abandoned() {
    if (!options_.simulation_progress) return {};
    return [this](double t) {
      if (!is_describing_) abandoned_ = abandoned_ || !options_.simulation_progress(t);
      return is_describing_ || !abandoned_;
    };
  }
  long simulations() const { return prepared_.evaluator.simulations() + program_.hessian_gradients(); }

  void begin() {
    result_.optimizer = prepared_.spec.optimizer.type;
    start_ = program_.start_from(prepared_.x_start, options_.scale);
    result_.scale = {program_.f_scale, program_.c_scale};
    result_.gradient_choice = start_.choice.empty() ? std::string(to_string(start_.method)) : start_.choice;
    describe_start(prepared_.problem, prepared_.evaluator, program_, start_, result_);
    if (!start_.ok || !options_.compare_differences) return;
    for (std::string& warning : difference_warnings(start_, prepared_.evaluator, [this] { return !abandoned_; }))
      result_.warnings.push_back(std::move(warning));
  }

  void search() {
    const auto progress = [this](const NlpProgress& p) {
      if (abandoned_) return false;  // the iterate before the one that was not reached
      result_.history.push_back({p.iteration, p.f, p.violation, p.optimality, prepared_.scaling.to_rho(p.x),
                                 result_.simulations + simulations()});
      return !options_.progress || options_.progress(result_.history.back());
    };
    rounds_ = solve_in_rounds(prepared_.spec, program_, prepared_.evaluator, prepared_.x_start,
                              {progress, [this] { return abandoned_.load(); }, options_.records}, result_);
    const NlpResult& solution = rounds_.solution;
    result_.status = abandoned_ ? SolverStatus::stopped : solution.status;
    result_.message = abandoned_ ? "stopped on request" : solution.message;
    result_.algorithm = solution.algorithm;
    result_.iterations = solution.iterations;
    result_.evaluations = solution.evaluations, result_.failed_evaluations = solution.failed_evaluations;
    result_.rho = program_.rho_at(solution.x);
  }

  // The end point of a stopped search is evaluated as well; nothing abandons that.
  void describe_last_point() {
    describe_end(prepared_.evaluator, program_, rounds_.solution, result_);
    if (abandoned_ && !options_.evaluate_stopped) return;
    is_describing_ = true;
    if (abandoned_ || rounds_.true_values.empty()) rounds_.true_values = prepared_.evaluator.true_values(result_.rho);
    describe_solution(program_, prepared_.scaling, rounds_, prepared_.spec.optimizer.tolerance, result_);
    if (!abandoned_) judge_solution(prepared_.spec, program_, prepared_.evaluator, result_);
  }

  void add_warnings() {
    const auto jumps = [](const Jump& jump) { return jump.size != 0; };
    if (std::ranges::none_of(result_.final_evaluation.statistics.jumps, jumps))  // those of the solution beside it
      for (const Jump& jump : start_.statistics.jumps)
        if (jumps(jump))
          result_.warnings.push_back("at the start, " + in_words(prepared_.evaluator.of_case(0).scene(), jump));
    if (!program_.hessian_failure().empty())
      result_.warnings.push_back(
          "design.optimizer.hessian: could not be computed everywhere, where it was not the one "
          "before served again; first: " +
          program_.hessian_failure());
  }

  const Stopwatch stopwatch_;
  const DesignOptions& options_;
  std::atomic<bool> abandoned_ = false, is_describing_ = false;  // read by the threads of all cases
  PreparedDesign prepared_;
  DesignProgram program_;
  DesignResult result_;
  CaseEvaluation start_;
  LimitedSolution rounds_;
};

}  // namespace

DesignResult single_design(const Problem& problem, const DesignOptions& options) {
  return SingleDesign(problem, options).run();
}

}  // namespace mbsopt::inline optim
