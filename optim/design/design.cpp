#include "optim/design/design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/driven/driven_simulation.hpp"
#include "core/expression/counted.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "core/start/assembly.hpp"
#include "core/start/assembly_modes.hpp"
#include "optim/design/closing.hpp"
#include "optim/design/design_program.hpp"
#include "optim/design/tracked_squares.hpp"
#include "optim/design/true_limits.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/case_objective.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/objective/integration_error.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/problem/seed.hpp"
#include "optim/problem/unused_parameters.hpp"
#include "optim/problem/variable_scaling.hpp"
#include "optim/solver/evaluated_points.hpp"
#include "optim/solver/ipopt_solver.hpp"
#include "optim/solver/nlopt_solver.hpp"
#include "optim/solver/optimality.hpp"

namespace mbsopt {
namespace {

constexpr double kStationary = 100;  // times the tolerance: docs/design-optimisation.md, `converged`
// The same for least squares. Where the cost settles to 1e-10 of itself, optimality is known to the root of that.
constexpr double kSettled = 1000;
constexpr double kTouches = 1e-5;  // relative to the bound's size: the barrier keeps solutions this near to a bound

bool touches(double value, const std::optional<double>& bound, double size) {
  return bound && std::abs(value - *bound) <= kTouches * size;
}

std::vector<Parameter> chosen(const Scene& scene, const std::vector<int>& indices) {
  std::vector<Parameter> parameters;
  for (const int k : indices) parameters.push_back(scene.parameters[static_cast<std::size_t>(k)]);
  return parameters;
}

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
  if (const std::vector<DesignIssue> issues = optimizer_issues(spec, problem.scene); !issues.empty())
    throw std::invalid_argument(issues[0].path + ": " + issues[0].message);
  if (const std::optional<DesignIssue> issue = curvature_issue(problem))
    throw std::invalid_argument(issue->path + ": " + issue->message);
  return spec;
}

std::vector<std::string> objective_names(const DesignSpec& spec) {
  std::vector<std::string> names{spec.minimize};
  for (const ObjectiveBound& bound : spec.subject_to) names.push_back(bound.objective);
  return names;
}

Eigen::VectorXd start_of(const CaseEvaluator& evaluator, const VariableScaling& scaling) {
  Eigen::VectorXd designed(scaling.size());
  for (Eigen::Index k = 0; k < designed.size(); ++k)
    designed(k) = evaluator.start()(evaluator.variables()[static_cast<std::size_t>(k)]);
  return scaling.to_x(designed);
}

void describe_start(const Problem& problem, const CaseEvaluator& evaluator, const DesignProgram& program,
                    const CaseEvaluation& start, DesignResult& result) {
  const DesignSpec& spec = *problem.design;
  result.objective = spec.minimize;
  for (const Parameter& p : chosen(problem.scene, evaluator.variables()))
    result.variables.push_back({p.name, p.unit, p.value, p.value, p.lower, p.upper, false, false});
  const Eigen::VectorXd minimised =
      start.ok ? program.minimised(start.psi) : Eigen::VectorXd::Zero(static_cast<Eigen::Index>(evaluator.cases()));
  if (start.ok) result.objective_initial = result.objective_final = program.objective().value(minimised);
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    const double value = minimised(static_cast<Eigen::Index>(c));
    result.cases.push_back({problem.cases[c].name, problem.cases[c].weight, value, value});
  }
  for (std::size_t c = 0; c < evaluator.cases(); ++c) {
    for (const ObjectiveBound& bound : spec.subject_to) {
      const Eigen::Index row = static_cast<Eigen::Index>(result.constraints.size());
      const double value = start.ok ? start.psi(program.psi_of(row)) : 0;
      DesignConstraint& constraint = result.constraints.emplace_back();
      constraint.objective = bound.objective, constraint.lower = bound.lower, constraint.upper = bound.upper;
      constraint.initial = constraint.value = value, constraint.load_case = evaluator.case_name(c);
    }
  }
}

// Where a derivative is exactly zero in all that takes part, a variable goes nowhere, by symmetry or because its force
// does not act (yet).
std::vector<std::string> idle_variables(const Evaluation& start, const Problem& problem) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < problem.design->variables.size(); ++k) {
    if (start.psi_rho.col(static_cast<Eigen::Index>(k)).any()) continue;
    warnings.push_back(fmt::format(
        "design.variables: '{}' has a derivative of exactly 0 at the start in all that the design uses ({}); it stays "
        "as it is unless others change that",
        problem.design->variables[k], joined(objective_names(*problem.design))));
  }
  return warnings;
}

double missed(const DesignConstraint& c, double value) {
  return std::max({0.0, c.lower ? *c.lower - value : 0.0, c.upper ? value - *c.upper : 0.0});
}

void describe_end(const CaseEvaluator& evaluator, const DesignProgram& program, const NlpPoint& end,
                  DesignResult& result) {
  for (std::size_t k = 0; k < result.variables.size(); ++k) {
    DesignVariable& v = result.variables[k];
    v.value = result.rho(evaluator.variables()[k]);
    const double size = v.lower && v.upper ? *v.upper - *v.lower : std::max(std::abs(v.initial), std::abs(v.value));
    v.at_lower = touches(v.value, v.lower, size), v.at_upper = touches(v.value, v.upper, size);
  }
  result.objective_final = end.f;
  result.violation = program.violation(end.c);
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    c.value = end.c(row) * program.size(row);
    c.violation = missed(c, c.value);
    c.at_lower = c.lower && touches(end.c(row), program.c_lower(row), 1);
    c.at_upper = c.upper && touches(end.c(row), program.c_upper(row), 1);
  }
}

// The solution of the last round.
struct LimitedSolution {
  NlpResult solution;  // counts those of all rounds
  std::vector<std::optional<double>> true_values;
  Eigen::VectorXd slopes;  // of true values in smooth ones
};

std::string limit_text(const std::string& name, bool is_upper, double bound) {
  return fmt::format("{} {} {:.6g}", name, is_upper ? "<=" : ">=", bound);
}

// The limits and bounds that stand against each other where no point near satisfies all limits.
void describe_conflict(const DesignProgram& program, const VariableScaling& scaling, const Eigen::VectorXd& x,
                       const NlpPoint& end, DesignResult& result) {
  constexpr double kNoPrice = 1e-6;  // relative to that of a limit that is violated, 1
  const Conflict found = conflict(program, x, end, kConstraintTolerance);
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    const DesignConstraint& c = result.constraints[i];
    const double z = found.of_constraints(static_cast<Eigen::Index>(i));
    if (std::abs(z) <= kNoPrice) continue;
    result.conflicts.push_back({limit_text(c.in_words(), z > 0, z > 0 ? *c.upper : *c.lower),
                                std::max(c.violation, c.true_violation),
                                std::abs(z) / program.size(static_cast<Eigen::Index>(i))});
  }
  const Eigen::VectorXd rho_x = scaling.rho_x(x);
  for (std::size_t k = 0; k < result.variables.size(); ++k) {
    const DesignVariable& v = result.variables[k];
    const Eigen::Index row = static_cast<Eigen::Index>(k);
    const double z = found.of_bounds(row);
    if (std::abs(z) <= kNoPrice) continue;
    result.conflicts.push_back(
        {limit_text(v.name, z > 0, z > 0 ? *v.upper : *v.lower), 0, std::abs(z) / std::abs(rho_x(row))});
  }
  std::string words;
  for (const DesignConflict& c : result.conflicts)
    words +=
        fmt::format("{}{} ({})", words.empty() ? "" : ", ", c.limit,
                    c.missed > 0 ? fmt::format("missed by {:.3g}", c.missed) : fmt::format("price {:.3g}", c.price));
  if (!words.empty()) result.message += "; in conflict: " + words;
}

// The values that are minimised case by case, and the true one that a smooth objective stands for.
void describe_objective(const DesignProgram& program, const std::vector<std::optional<double>>& true_values,
                        DesignResult& result) {
  if (!result.final_evaluation.ok) return;
  Eigen::VectorXd values = program.minimised(result.final_evaluation.psi);
  const Eigen::Index stride = static_cast<Eigen::Index>(true_values.size()) / values.size();
  bool smooth = program.objective().is_maximum();
  for (Eigen::Index c = 0; c < values.size(); ++c) {
    const std::optional<double>& true_value = true_values[static_cast<std::size_t>(c * stride)];
    if (!result.cases.empty()) {
      DesignCase& of_case = result.cases[static_cast<std::size_t>(c)];
      of_case.value = values(c), of_case.true_value = true_value;
    }
    smooth = smooth || true_value;
    values(c) = true_value.value_or(values(c));
  }
  if (smooth) result.objective_true = program.objective().true_value(values);
}

// One more look at the solution: the final evaluation, true extremes, how stationary it is, and what limits cost.
void describe_solution(DesignProgram& program, const VariableScaling& scaling, const LimitedSolution& rounds,
                       DesignResult& result) {
  const Eigen::VectorXd& x = rounds.solution.x;
  result.final_evaluation = program.evaluation(result.rho);
  describe_objective(program, rounds.true_values, result);
  result.true_violation = result.violation;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    c.true_value = rounds.true_values[static_cast<std::size_t>(program.psi_of(static_cast<Eigen::Index>(i)))];
    c.true_violation = missed(c, c.true_value.value_or(c.value));
    if (c.true_value) c.violation = c.true_violation;
    result.true_violation =
        std::max(result.true_violation, c.true_violation / program.size(static_cast<Eigen::Index>(i)));
  }
  NlpPoint end;
  end.f_x.setZero(program.variables()), end.c.setZero(program.constraints());
  end.c_x.setZero(program.constraints(), program.variables());
  program.evaluate(x, end);
  if (!end.ok) return;
  const Stationarity found = stationarity(program, x, end);
  result.optimality = found.distance;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    const double fall =
        found.multipliers(row) * program.c_scale(row) / (program.f_scale * program.size(row) * rounds.slopes(row));
    c.price = c.lower && c.upper && *c.lower == *c.upper ? fall : std::abs(fall);
  }
  if (result.status == SolverStatus::infeasible) describe_conflict(program, scaling, x, end, result);
}

// Least squares converges by its steps. Where a solved run leaves no noise, that is an optimum only with the optimality
// conditions.
void judge_stationarity(const DesignSpec& spec, DesignResult& result) {
  const bool judged = spec.optimizer.type == OptimizerSpec::kLeastSquares && result.final_evaluation.ok &&
                      result.final_evaluation.of_cases.front().statistics.solved;
  if (!judged || result.status != SolverStatus::converged) return;
  if (result.optimality <= kSettled * spec.optimizer.tolerance) return;
  result.status = SolverStatus::no_progress;
  result.message = fmt::format(
      "no further progress: cost and parameters settle where the optimality is {:.1g}, a kink "
      "or a dead point",
      result.optimality);
}

// Says where a limit on an extreme does not hold for the true one, in spite of bounds that were moved.
void judge_true_extremes(const DesignProgram& program, const CaseEvaluator& evaluator, DesignResult& result) {
  bool beyond = false;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    const DesignConstraint& c = result.constraints[i];
    const std::size_t bounds = result.constraints.size() / evaluator.cases();
    const Extreme extreme = evaluator.of_case(i / bounds).objectives()[i % bounds + 1].extreme();
    if (extreme == Extreme::none) continue;
    const char* const what = extreme == Extreme::maximum   ? "maximum"
                             : extreme == Extreme::minimum ? "minimum"
                                                           : "peak to peak value";
    const std::string place = fmt::format("design.subject_to[{}]: the {} of '{}'", i % bounds, what, c.in_words());
    if (!c.true_value) {
      beyond = true;
      result.warnings.push_back(place +
                                " is held by its smooth value only; the run that was to find the true one failed");
      continue;
    }
    const bool equality = c.lower && c.upper && *c.lower == *c.upper;
    const double size = program.size(static_cast<Eigen::Index>(i));
    if (c.true_violation <= (equality ? kTrueLimitTolerance * size : 0)) continue;
    beyond = true;
    const bool above = c.upper && *c.true_value > *c.upper;
    result.warnings.push_back(
        fmt::format("{} is {:.6g}, {} the limit {:.6g}, though its smooth value is {:.6g}; more sharpness brings the "
                    "two together",
                    place, *c.true_value, above ? "above" : "below", above ? *c.upper : *c.lower, c.value));
  }
  if (!beyond || result.status != SolverStatus::converged) return;
  result.status = SolverStatus::converged_beyond_limit;
  result.message += "; limits hold for smooth extremes only";
}

NlpResult solved_once(DesignProgram& program, const CaseEvaluator& evaluator, const Eigen::VectorXd& x_start,
                      const OptimizerSpec& spec, const std::function<bool(const NlpProgress&)>& progress,
                      PointRecords* records, DesignResult& result) {
  std::optional<long>& seed = result.seed;
  if (spec.type == OptimizerSpec::kLeastSquares)
    return solve_tracked_squares(program, evaluator, x_start, spec, progress, records, result.simulations);
  if (spec.type == "ipopt") {
    IpoptOptions solver;
    solver.tolerance = spec.tolerance;
    solver.constraint_tolerance = kConstraintTolerance;
    solver.max_iterations = static_cast<int>(spec.max_iterations.value_or(OptimizerSpec::kIpoptIterations));
    solver.max_evaluations = spec.max_evaluations;
    if (spec.lbfgs_history) solver.history = static_cast<int>(*spec.lbfgs_history);
    solver.second_order = spec.hessian != "lbfgs";
    solver.gauss_newton = spec.hessian == "gauss_newton";
    solver.progress = progress;
    solver.records = records;
    solver.warm_start = spec.warm_start;
    NlpResult solution = solve_with_ipopt(program, x_start, solver);
    if (solver.second_order)
      solution.algorithm = fmt::format("Ipopt: interior point, {} Hessian",
                                       spec.hessian == "exact" ? "exact" : "generalised Gauss-Newton");
    return solution;
  }
  NloptOptions solver;
  solver.method = spec.type;
  solver.tolerance = spec.tolerance;
  solver.constraint_tolerance = kConstraintTolerance;
  solver.max_evaluations = spec.max_evaluations;
  solver.max_iterations = spec.max_iterations;
  if (spec.lbfgs_history) solver.history = static_cast<unsigned>(*spec.lbfgs_history);
  if (find_nlopt_method(spec.type)->random) {
    if (!seed) seed = spec.seed.value_or(drawn_seed());
    solver.seed = static_cast<std::uint32_t>(*seed);
  }
  solver.progress = progress;
  solver.records = records;
  return solve_with_nlopt(program, x_start, solver);
}

// What an optimiser may still do after an earlier round. A global method searches as long in every round.
OptimizerSpec remaining(OptimizerSpec spec, const NlpResult& done) {
  const NloptMethod* const method = find_nlopt_method(spec.type);
  if (method && method->global) return spec;
  if (!method) spec.max_iterations = spec.max_iterations.value_or(OptimizerSpec::kIpoptIterations);
  if (spec.max_iterations) *spec.max_iterations = std::max(0L, *spec.max_iterations - done.iterations);
  if (spec.max_evaluations) *spec.max_evaluations = std::max(0L, *spec.max_evaluations - done.evaluations);
  return spec;
}

bool may_go_on(const OptimizerSpec& spec) {
  return spec.max_iterations.value_or(1) > 0 && spec.max_evaluations.value_or(1) > 0;
}

bool is_an_end(SolverStatus status) {
  return status == SolverStatus::converged || status == SolverStatus::no_progress || status == SolverStatus::searched;
}

bool is_an_improvement(const DesignProgram& program, const NlpResult& found, const NlpResult& before) {
  if (found.status == SolverStatus::converged) return true;
  return found.point.ok && is_better(found.point.f, program.violation(found.point.c), before.point.f,
                                     program.violation(before.point.c), kConstraintTolerance);
}

// Solves in rounds, with bounds that are moved until true extremes keep their limits.
LimitedSolution solved(const DesignSpec& spec, DesignProgram& program, CaseEvaluator& evaluator,
                       const Eigen::VectorXd& x_start, const std::function<bool(const NlpProgress&)>& progress,
                       const std::function<bool()>& abandoned, PointRecords* records, DesignResult& result) {
  TrueLimits limits(spec, evaluator);
  LimitedSolution rounds;
  NlpResult& solution = rounds.solution;
  solution = solved_once(program, evaluator, x_start, spec.optimizer, progress, records, result);
  while (true) {
    if (!solution.point.ok || abandoned()) break;
    const Eigen::VectorXd rho = program.rho_at(solution.x);
    rounds.true_values = evaluator.true_values(rho);
    if (!is_an_end(solution.status)) break;
    if (!limits.move(program, solution.point.c, rounds.true_values)) break;
    // From the last solution; from the first start where a method gets stuck there, beyond a bound that was moved.
    for (const bool from_solution : {true, false}) {
      OptimizerSpec rest = remaining(spec.optimizer, solution);
      if (!may_go_on(rest)) {
        solution.status = SolverStatus::iteration_limit;
        solution.message =
            "stopped at the limit of iterations or evaluations, before the limits held for true extremes";
        break;
      }
      rest.warm_start = from_solution || rest.warm_start;
      const NlpResult before = solution;
      const auto shown = [&](NlpProgress p) {
        if (p.iteration == 0) return true;  // known from before
        p.iteration += before.iterations;
        return progress(p);
      };
      NlpResult found =
          solved_once(program, evaluator, from_solution ? before.x : x_start, rest, shown, records, result);
      const bool is_worse = !from_solution && !is_an_improvement(program, found, before);
      solution = is_worse ? before : found;
      solution.iterations = found.iterations + before.iterations;
      solution.evaluations = found.evaluations + before.evaluations;
      solution.failed_evaluations = found.failed_evaluations + before.failed_evaluations;
      if (solution.status != SolverStatus::no_progress && solution.status != SolverStatus::infeasible) break;
    }
  }
  result.limit_rounds = limits.rounds();
  rounds.slopes.resize(program.constraints());
  for (Eigen::Index i = 0; i < program.constraints(); ++i) rounds.slopes(i) = limits.slope(i);
  return rounds;
}

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

Problem with_named_means(Problem problem) {
  name_bounded_means(problem);
  return problem;
}

// What runs of a design have in common.
struct Prepared {
  Prepared(const Problem& given, const DesignOptions& options, std::function<bool(double t)> progress)
      : problem(with_named_means(given)),
        spec(checked(problem)),
        evaluator(problem, objective_names(spec), spec.variables, evaluator_options(options, std::move(progress)),
                  options.threads),
        scaling(chosen(problem.scene, evaluator.variables())),
        x_start(start_of(evaluator, scaling)) {
    if (!spec.sharpness) spec.sharpness = sharpness();
  }

  // Of the maximum over cases: relative to the largest value at the start.
  std::optional<double> sharpness() {
    if (spec.over != "max" || problem.cases.size() < 2) return std::nullopt;
    const CaseEvaluation& start = evaluator.gradients(evaluator.start());
    double largest = 0;
    for (std::size_t c = 0; c < problem.cases.size() && start.ok; ++c)
      largest = std::max(largest, std::abs(problem.cases[c].weight * start.of_cases[c].psi(0)));
    return DesignSpec::kSharpness / (largest > 0 ? largest : 1);
  }
  CaseObjective objective() const { return {problem.cases, spec}; }

  static EvaluatorOptions evaluator_options(const DesignOptions& options, std::function<bool(double t)> progress) {
    EvaluatorOptions result;
    result.method = options.method, result.user_forces = options.user_forces, result.progress = std::move(progress);
    return result;
  }

  const Problem problem;
  DesignSpec spec;
  CaseEvaluator evaluator;
  const VariableScaling scaling;
  const Eigen::VectorXd x_start;
};

}  // namespace

std::string DesignConstraint::in_words() const {
  return load_case.empty() ? objective : fmt::format("{} ({})", objective, load_case);
}

bool DesignResult::is_at_boundary() const {
  return std::ranges::any_of(variables, [](const DesignVariable& v) { return v.at_lower || v.at_upper; }) ||
         std::ranges::any_of(constraints, [](const DesignConstraint& c) { return c.at_lower || c.at_upper; });
}

std::optional<double> design_sharpness(const Problem& problem, const DesignOptions& options) {
  return Prepared(problem, options, options.simulation_progress).spec.sharpness;
}

NlpScale design_scale(const Problem& problem, const DesignOptions& options) {
  Prepared p(problem, options, options.simulation_progress);
  DesignProgram program(p.spec, p.evaluator, p.scaling, p.objective());
  program.start_from(p.x_start);
  return {program.f_scale, program.c_scale};
}

namespace {

struct StartModes {
  std::vector<AssemblyMode> modes;
  bool abandoned = false;
};

StartModes modes_at(const Scene& scene, const DesignOptions& options) {
  const Mechanism mechanism(scene, parameter_values(scene), std::vector<bool>(scene.parameters.size(), false));
  const double t = scene.simulation.start_time;
  StartModes found;
  found.modes = assembly_modes(mechanism, t, [&] {
    found.abandoned = options.simulation_progress && !options.simulation_progress(t);
    return !found.abandoned;
  });
  return found;
}

DesignResult designed(const Problem& given, const DesignOptions& options);

// The problem with a start at which its linkage closes, where it does not at the given one and such a start is found.
Problem closed(const Problem& given, const DesignOptions& options, int& steps) {
  try {
    const std::vector<bool> none(given.scene.parameters.size(), false);
    if (!may_be_solved(Mechanism(given.scene, parameter_values(given.scene), none), given.scene.simulation))
      return given;
  } catch (const SceneError&) {  // a field is out of its range here: the first evaluation says so
    return given;
  }
  bool abandoned = false;
  const auto go_on = [&] {
    abandoned =
        abandoned || (options.simulation_progress && !options.simulation_progress(given.scene.simulation.start_time));
    return !abandoned;
  };
  const Prepared prepared(given, options, options.simulation_progress);
  const ClosedStart start = close_start(prepared.evaluator, prepared.scaling, prepared.x_start, go_on);
  steps = start.closes ? start.steps : 0;
  if (steps == 0) return given;
  Problem problem = given;
  const Eigen::VectorXd values = prepared.scaling.to_rho(start.x);
  for (std::size_t k = 0; k < prepared.evaluator.variables().size(); ++k)
    problem.scene.parameters[static_cast<std::size_t>(prepared.evaluator.variables()[k])].value =
        values(static_cast<Eigen::Index>(k));
  return problem;
}

// Far from the start its poses may lead to another mode, which is a jump that stops a search. Where one ends without
// being stationary, it goes on with the poses that it has reached as its guess, as long as this makes the design
// better. Returns whether the problem has other poses now.
bool keep_mode(Problem& problem, const DesignOptions& options, DesignResult& result) {
  constexpr int kMostMoves = 5;
  constexpr double kHeld = 1e-6;  // violation of limits: what ranks as feasible
  bool moved = false;
  DesignOptions unrecorded = options;  // points are known by their scaled variables, whose units the start decides
  unrecorded.records = nullptr, unrecorded.compare_differences = false;
  for (int k = 0; k < kMostMoves; ++k) {
    const bool is_stationary = result.status == SolverStatus::converged &&
                               result.optimality <= kStationary * problem.design->optimizer.tolerance;
    if (is_stationary || (result.status != SolverStatus::converged && result.status != SolverStatus::no_progress))
      break;
    Problem next = problem;
    for (std::size_t p = 0; p < next.scene.parameters.size(); ++p)
      next.scene.parameters[p].value = result.rho(static_cast<Eigen::Index>(p));
    const Mechanism mechanism(next.scene, result.rho, std::vector<bool>(next.scene.parameters.size(), false));
    const Assembly reached(mechanism, next.scene.simulation.start_time);
    if (!reached.result().ok) break;
    set_guess(next.scene, mechanism, {reached.result().y.head(reached.result().y.size() / 2), 0});
    DesignResult more;
    try {
      more = designed(next, unrecorded);
    } catch (const std::exception&) {  // a singular position, where parameters stand against each other
      break;
    }
    const bool is_better = more.final_evaluation.ok && more.violation <= std::max(result.violation, kHeld) &&
                           more.objective_final < result.objective_final;
    more.objective_initial = result.objective_initial;
    more.iterations += result.iterations, more.evaluations += result.evaluations;
    more.failed_evaluations += result.failed_evaluations;
    more.simulations += result.simulations, more.wall_seconds += result.wall_seconds;
    for (std::size_t v = 0; v < more.variables.size(); ++v) more.variables[v].initial = result.variables[v].initial;
    for (std::size_t c = 0; c < more.constraints.size(); ++c)
      more.constraints[c].initial = result.constraints[c].initial;
    for (std::size_t c = 0; c < more.cases.size(); ++c) more.cases[c].initial = result.cases[c].initial;
    if (!is_better) {
      result.iterations = more.iterations, result.evaluations = more.evaluations;
      result.failed_evaluations = more.failed_evaluations;
      result.simulations = more.simulations, result.wall_seconds = more.wall_seconds;
      break;
    }
    std::vector<DesignRow> history = std::move(result.history);
    const int before = history.empty() ? 0 : history.back().iteration;
    for (DesignRow& row : more.history)
      if (row.iteration > 0) row.iteration += before, history.push_back(row);
    more.history = std::move(history);
    result = std::move(more), problem = std::move(next), moved = true;
  }
  return moved;
}

// As designed, with the poses of the mode.
DesignResult designed_in_mode(const Problem& given, const DesignOptions& options) {
  const int mode = *options.mode;
  const auto [modes, abandoned] = modes_at(given.scene, options);
  if (abandoned || mode >= static_cast<int>(modes.size())) {
    DesignResult none;
    none.objective = given.design->minimize, none.optimizer = given.design->optimizer.type;
    for (const std::string& name : given.design->variables) {
      const Parameter& p = *std::ranges::find(given.scene.parameters, name, &Parameter::name);
      none.variables.push_back({p.name, p.unit, p.value, p.value, p.lower, p.upper, false, false});
    }
    none.rho = parameter_values(given.scene);
    if (abandoned) {
      none.status = SolverStatus::stopped, none.message = "stopped on request";
      return none;
    }
    none.mode = DesignMode{mode, static_cast<int>(modes.size())};
    none.message = fmt::format("has no assembly mode {}: {} found at its start", mode, counted(modes.size(), "mode"));
    return none;
  }
  Problem problem = given;
  const std::vector<bool> none(given.scene.parameters.size(), false);
  const Mechanism mechanism(given.scene, parameter_values(given.scene), none);
  const bool posed = mode > 0 || !Assembly(mechanism, given.scene.simulation.start_time).result().ok;
  if (posed) set_guess(problem.scene, mechanism, modes[static_cast<std::size_t>(mode)]);
  DesignOptions without_mode = options;
  without_mode.mode.reset();
  DesignResult result = designed(problem, without_mode);
  const bool moved = keep_mode(problem, without_mode, result);
  result.mode = DesignMode{mode, static_cast<int>(modes.size()), {}};
  if (posed || moved) result.mode->bodies = problem.scene.bodies;
  return result;
}

}  // namespace

int design_modes(const Problem& problem, const DesignOptions& options) {
  return static_cast<int>(modes_at(problem.scene, options).modes.size());
}

std::optional<Problem> problem_that_closes(const Problem& problem, const DesignOptions& options) {
  int steps = 0;
  Problem found = closed(problem, options, steps);
  if (steps == 0) return {};
  return found;
}

DesignResult run_design(const Problem& given, const DesignOptions& options) {
  int steps = 0;
  const Problem problem = closed(given, options, steps);
  DesignResult result = options.mode ? designed_in_mode(problem, options) : designed(problem, options);
  result.closing_steps = steps;
  if (steps > 0)
    for (DesignVariable& v : result.variables)
      v.initial = std::ranges::find(given.scene.parameters, v.name, &Parameter::name)->value;
  return result;
}

namespace {

DesignResult designed(const Problem& given, const DesignOptions& options) {
  const Stopwatch stopwatch;
  std::atomic<bool> abandoned = false;  // read by the threads of all cases
  std::function<bool(double t)> until_abandoned;
  if (options.simulation_progress)
    until_abandoned = [&](double t) { return abandoned = abandoned || !options.simulation_progress(t), !abandoned; };
  Prepared prepared(given, options, until_abandoned);
  const Problem& problem = prepared.problem;
  const DesignSpec& spec = prepared.spec;
  CaseEvaluator& evaluator = prepared.evaluator;
  const VariableScaling& scaling = prepared.scaling;
  const Eigen::VectorXd& x_start = prepared.x_start;
  DesignProgram program(spec, evaluator, scaling, prepared.objective(), [&] { return abandoned.load(); });

  DesignResult result;
  result.optimizer = spec.optimizer.type;
  const CaseEvaluation start = program.start_from(x_start, options.scale);
  result.scale = {program.f_scale, program.c_scale};
  result.gradient_choice = start.choice.empty() ? std::string(to_string(start.method)) : start.choice;
  describe_start(problem, evaluator, program, start, result);
  if (start.ok) result.warnings = idle_variables(start, problem);
  if (start.ok && options.compare_differences) {
    std::vector<std::vector<std::string>> warnings(evaluator.cases());
    evaluator.for_each_case([&](std::size_t c) {
      DifferenceComparison comparison = comparison_at(start.of_cases[c], evaluator.of_case(c));
      comparison.go_on = [&] { return !abandoned; };
      warnings[c] = comparison.warnings();
    });
    for (std::size_t c = 0; c < warnings.size(); ++c)
      for (const std::string& warning : warnings[c])
        result.warnings.push_back("design.variables: " + evaluator.in_case(c, warning));
  }

  const auto progress = [&](const NlpProgress& p) {
    if (abandoned) return false;  // the iterate before the one that was not reached
    result.history.push_back({p.iteration, p.f, p.violation, p.optimality, scaling.to_rho(p.x),
                              result.simulations + evaluator.simulations() + program.hessian_gradients()});
    return !options.progress || options.progress(result.history.back());
  };
  const LimitedSolution rounds = solved(
      spec, program, evaluator, x_start, progress, [&] { return abandoned.load(); }, options.records, result);
  const NlpResult& solution = rounds.solution;
  result.status = abandoned ? SolverStatus::stopped : solution.status;
  result.message = abandoned ? "stopped on request" : solution.message;
  result.algorithm = solution.algorithm;
  result.iterations = solution.iterations;
  result.evaluations = solution.evaluations, result.failed_evaluations = solution.failed_evaluations;
  result.rho = program.rho_at(solution.x);
  if (start.ok && solution.point.ok) {
    describe_end(evaluator, program, solution.point, result);
    if (!abandoned && !rounds.true_values.empty()) {
      describe_solution(program, scaling, rounds, result);
      judge_stationarity(spec, result);
      judge_true_extremes(program, evaluator, result);
    }
  }
  if (result.final_evaluation.statistics.jumps.empty())  // those of the solution stand beside it
    for (const Jump& jump : start.statistics.jumps)
      result.warnings.push_back("at the start, " + in_words(evaluator.of_case(0).scene(), jump));
  if (!program.hessian_failure().empty())
    result.warnings.push_back(
        "design.optimizer.hessian: could not be computed everywhere, where it was not the one "
        "before served again; first: " +
        program.hessian_failure());
  result.simulations += evaluator.simulations() + program.hessian_gradients();
  result.wall_seconds = stopwatch.seconds();
  return result;
}

}  // namespace

}  // namespace mbsopt
