#include "optim/design/design_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "core/expression/counted.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "core/start/assembly.hpp"
#include "optim/design/chosen_solver.hpp"
#include "optim/design/closing.hpp"
#include "optim/design/design_description.hpp"
#include "optim/design/design_program.hpp"
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

  // Returns in words what the optimiser is given.
  std::string description() const {
    const OptimizerSpec& spec = program_.spec().optimizer;
    std::string words = fmt::format("{} on {}", spec.chosen(), counted(program_.variables(), "variable"));
    if (program_.constraints() > 0) words += " within " + counted(program_.constraints(), "limit");
    if (program_.has_squares()) words += ", curvature of squares by Gauss-Newton";
    if (smooths())
      words += ", smooth extremes";
    else if (std::ranges::any_of(program_.evaluator().objectives(), &Objective::is_extreme))
      words += ", extremes peak by peak";
    return words;
  }
  const std::vector<std::string>& doubts() const { return doubts_; }  // about derivatives at the start
  // Whether the optimiser sees smooth extremes in place of true ones.
  bool smooths() const {
    if (program_.spec().optimizer.is_sqp()) return false;
    return program_.objective().is_maximum() ||
           std::ranges::any_of(program_.evaluator().objectives(), &Objective::is_extreme);
  }
  const std::vector<Body>& bodies() const { return program_.problem().scene.bodies; }
  const OptimizerSpec& optimizer() const { return program_.spec().optimizer; }
  // Squares at free instants, of which least_squares alone has a Gauss-Newton matrix.
  bool has_free_squares() const {
    const Objective& minimised = program_.evaluator().of_case(0).objectives()[0];
    return program_.spec().optimizer.type == OptimizerSpec::kLeastSquares && minimised.free_instants();
  }
  std::vector<double> instants() const { return closing_instants(program_.evaluator().of_case(0)); }

  DesignResult run() {
    begin();
    search();
    if (start_.ok && solution_.point.ok) describe_last_point();
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
    doubts_ = difference_warnings(start_, program_.evaluator(), [this] { return !abandoned_; });
    result_.warnings.insert(result_.warnings.end(), doubts_.begin(), doubts_.end());
  }

  void search() {
    const auto progress = [this](const NlpProgress& p) {
      if (abandoned_) return false;  // the iterate before the one that was not reached
      result_.history.push_back({p.iteration, program_.spec().sign() * p.f, p.violation, p.optimality,
                                 program_.scaling().to_rho(p.x), result_.simulations + simulations()});
      return !options_.progress || options_.progress(result_.history.back());
    };
    solution_ = solve(program_, progress, result_);
    static_cast<SolverOutcome&>(result_) = solution_;
    if (abandoned_) result_.end_on_request();
    result_.algorithm = solution_.algorithm;
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
    describe_end(program_, solution_, result_);
    describe_poses();
    if (abandoned_ && !options_.evaluate_stopped) return;
    is_describing_ = true;
    describe_solution(program_, solution_.x, result_);
    if (abandoned_) return;
    judge_solution(program_, result_);
    if (result_.status == SolverStatus::no_progress) add_advice();
  }

  void add_advice() {
    if (!result_.final_evaluation.statistics.solved)
      result_.message += "; try tighter simulation tolerances, or a larger optimiser tolerance";
    else if (result_.failed_evaluations > 0)
      result_.message +=
          "; beside this design the linkage comes to a dead point: a limit on smallest_singular_value or on a "
          "transmission angle keeps it away";
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
  std::vector<std::string> doubts_;
  NlpResult solution_;
};

// The problem with a limit on the distance from dead points, where the Jacobian of joints and drives is singular.
Problem away_from_dead_points(Problem problem, const std::vector<double>& instants) {
  // The largest smallest_singular_value is 1. Of two sets of 60 starts of a four-bar's path, 102 to 104 end in an
  // optimum with limits from 0.05 to 0.2.
  constexpr double kDistance = 0.1;
  Sensor sensor;
  sensor.quantity = "smallest_singular_value";
  sensor.name = "distance_from_dead_points";
  while (std::ranges::count(problem.scene.sensors, sensor.name, &Sensor::name) > 0) sensor.name += "_";
  problem.scene.sensors.push_back(sensor);
  double end = problem.scene.simulation.end_time;
  for (const CaseSpec& load_case : problem.cases) end = std::min(end, load_case.end_time.value_or(end));
  for (const double t : instants) {
    if (t > end) continue;
    ObjectiveSpec& distance = problem.objectives.emplace_back();
    distance.name = fmt::format("{} at {:.17g} s", sensor.name, t);
    distance.samples.push_back({t, Expression::parse(sensor.name + "^2")});  // near a dead point linear in lengths
    ObjectiveBound& limit = problem.design->subject_to.emplace_back();
    limit.objective = distance.name;
    limit.lower = kDistance * kDistance;
  }
  return problem;
}

// Searches that follow each other until one ends at an optimum, and the best of them:
//
//   the optimiser of the problem
//   sqp      from the end of another local method that stalls or does not reach the limits, and of any method that has
//            seen smooth extremes: it takes true ones
//   ipopt    from the start, if `auto` finds no point near that satisfies the limits: it may come to another valley
//   sqp      from the start with a distance from dead points, and from there without, if these fall into one
//
// Squares at free instants go on by least_squares, from the poses of its end.
class Searches {
 public:
  Searches(const Problem& problem, const DesignOptions& options) : problem_(problem), options_(options) {}

  DesignResult run() {
    SingleDesign first(problem_, options_);
    best_ = first.run();
    note(first, "from the start", best_);
    const OptimizerSpec& spec = first.optimizer();
    if (spec.type == "sqp" || !best_.final_evaluation.ok) return ended();
    options_.compare_differences = false;
    options_.scale.reset();  // that of the first start
    doubts_ = first.doubts();
    const NloptMethod* const method = find_nlopt_method(spec.type);
    const bool is_global = method && method->global;
    if (spec.is_sqp()) {
      if (best_.status == SolverStatus::infeasible) go_on_with_ipopt();
    } else if (first.has_free_squares()) {
      go_on_in_poses();
    } else if (first.smooths() || (!is_global && is_stuck())) {
      go_on_with_sqp();
    }
    if (!is_global && !first.has_free_squares() && falls_into_dead_point()) go_round_dead_points(first.instants());
    return ended();
  }

 private:
  DesignResult ended() {
    best_.decisions = std::move(decisions_);
    return std::move(best_);
  }
  void note(const SingleDesign& search, const char* from, const DesignResult& end) {
    decisions_.push_back(fmt::format("{}, {}: {} after {}, objective {:.7g}. {}", search.description(), from,
                                     to_string(end.status), counted(end.evaluations, "evaluation"),
                                     end.objective_true.value_or(end.objective_final), end.message));
  }

  bool is_stuck() const {
    return best_.status == SolverStatus::no_progress || best_.status == SolverStatus::infeasible;
  }
  bool falls_into_dead_point() const {
    return best_.status == SolverStatus::no_progress && best_.failed_evaluations > 0 &&
           best_.final_evaluation.statistics.solved;
  }

  void go_on_with_ipopt() {
    if (std::optional<SingleDesign> search = prepared(problem_, "ipopt"))
      if (take(*search, "from the start, as it may find another valley") && search->smooths()) go_on_with_sqp();
  }
  void go_on_with_sqp() {
    if (std::optional<SingleDesign> search = prepared(continued(best_), "sqp")) take(*search, "from that end");
  }
  void go_on_in_poses() {
    constexpr int kMost = 5;
    for (int k = 0; k < kMost && best_.status == SolverStatus::no_progress; ++k) {
      std::optional<SingleDesign> search = prepared(continued(best_), OptimizerSpec::kLeastSquares);
      if (!search || !take(*search, "from that end, in its poses")) return;
    }
  }
  void go_round_dead_points(const std::vector<double>& instants) {
    std::optional<SingleDesign> search = prepared(away_from_dead_points(problem_, instants), "sqp");
    if (!search) return;
    const DesignResult guarded = search->run();
    note(*search, "from the start, with a distance from dead points", guarded);
    best_.add_counts(guarded);
    if (guarded.status == SolverStatus::stopped) return best_.end(guarded.status, guarded.message);
    if (!guarded.final_evaluation.ok) return;
    if (std::optional<SingleDesign> last = prepared(continued(guarded), "sqp"))
      take(*last, "from that end, without the distance");
  }

  // The problem from the end of a search, in its poses.
  Problem continued(const DesignResult& from) const {
    Problem next = problem_;
    for (std::size_t p = 0; p < next.scene.parameters.size(); ++p)
      next.scene.parameters[p].value = from.rho(static_cast<Eigen::Index>(p));
    if (from.mode && !from.mode->bodies.empty()) next.scene.bodies = from.mode->bodies;
    if (!from.final_evaluation.statistics.solved) return next;
    const Mechanism mechanism(next.scene, from.rho, std::vector<bool>(next.scene.parameters.size(), false),
                              options_.user_forces);
    const Assembly reached(mechanism, next.scene.simulation.start_time);
    if (reached.result().ok)
      set_guess(next.scene, mechanism, {reached.result().y.head(reached.result().y.size() / 2), 0});
    return next;
  }

  // None if the searches before have spent all that the optimiser may spend.
  std::optional<SingleDesign> prepared(Problem problem, const char* type) {
    const OptimizerSpec& given = problem_.design->optimizer;
    OptimizerSpec& spec = problem.design->optimizer;
    spec = {};
    spec.type = type;
    spec.tolerance = given.tolerance;
    if (given.max_iterations) spec.max_iterations = *given.max_iterations - best_.iterations;
    if (given.max_evaluations) spec.max_evaluations = *given.max_evaluations - best_.evaluations;
    if (best_.status == SolverStatus::stopped || spec.max_iterations.value_or(1) <= 0 ||
        spec.max_evaluations.value_or(1) <= 0)
      return {};
    return std::optional<SingleDesign>(std::in_place, problem, options_);
  }

  // Runs a search and keeps the better end. Returns whether that is its own.
  bool take(SingleDesign& search, const char* from) {
    DesignResult other = search.run();
    note(search, from, other);
    if (!is_better_than_best(other)) {
      best_.add_counts(other);
      if (other.status == SolverStatus::stopped) best_.end(other.status, other.message);
      return false;
    }
    Scene there = problem_.scene;
    there.bodies = search.bodies();
    if (!other.mode && lead_to_other_poses(problem_.scene, there, other.rho, options_.user_forces))
      other.mode = DesignMode{0, 0, search.bodies()};
    if (other.status != SolverStatus::converged)
      other.message += fmt::format("; {} before: {}", best_.optimizer, best_.message);
    other.warnings.insert(other.warnings.begin(), doubts_.begin(), doubts_.end());
    other.follow(std::move(best_));
    best_ = std::move(other);
    return true;
  }
  bool is_better_than_best(const DesignResult& other) const {
    constexpr double kHeld = 1e-6;  // violation of limits: what ranks as feasible
    if (!other.final_evaluation.ok) return false;
    if (other.missed() > kHeld || best_.missed() > kHeld) return other.missed() < best_.missed();
    const bool converges = other.status == SolverStatus::converged && best_.status != SolverStatus::converged;
    return other.reached() < best_.reached() || (converges && other.reached() <= best_.reached());
  }

  const Problem& problem_;
  DesignOptions options_;
  std::vector<std::string> doubts_, decisions_;
  DesignResult best_;
};

}  // namespace

DesignResult single_design(const Problem& problem, const DesignOptions& options) {
  return Searches(problem, options).run();
}

}  // namespace mbsopt::inline optim
