#include "optim/design/design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "optim/design/design_program.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/objective/integration_error.hpp"
#include "optim/problem/seed.hpp"
#include "optim/problem/unused_parameters.hpp"
#include "optim/problem/variable_scaling.hpp"
#include "optim/solver/ipopt_solver.hpp"
#include "optim/solver/nlopt_solver.hpp"
#include "optim/solver/optimality.hpp"

namespace mbsopt {
namespace {

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
  if (spec.optimizer.type != "ipopt" && !find_nlopt_method(spec.optimizer.type))
    throw std::invalid_argument(
        fmt::format("design.optimizer.type: is '{}'; available: ipopt {}", spec.optimizer.type, nlopt_method_names()));
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

Eigen::VectorXd start_of(const Evaluator& evaluator, const VariableScaling& scaling) {
  Eigen::VectorXd designed(scaling.size());
  for (Eigen::Index k = 0; k < designed.size(); ++k)
    designed(k) = evaluator.start()(evaluator.variables()[static_cast<std::size_t>(k)]);
  return scaling.to_x(designed);
}

void describe_start(const Problem& problem, const Evaluator& evaluator, const Evaluation& start, DesignResult& result) {
  const DesignSpec& spec = *problem.design;
  result.objective = spec.minimize;
  for (const Parameter& p : chosen(problem.scene, evaluator.variables()))
    result.variables.push_back({p.name, p.unit, p.value, p.value, p.lower, p.upper, false, false});
  if (start.ok) result.objective_initial = result.objective_final = start.psi(0);
  for (std::size_t i = 0; i < spec.subject_to.size(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[i];
    const double value = start.ok ? start.psi(static_cast<Eigen::Index>(i) + 1) : 0;
    result.constraints.push_back({bound.objective, bound.lower, bound.upper, value, value, {}, 0, false, false});
  }
}

// Where a derivative is exactly zero in all that takes part, a variable goes nowhere, by symmetry or because its force
// does not act (yet).
std::vector<std::string> idle_variables(const Evaluation& start, const DesignSpec& spec, const Evaluator& evaluator) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < evaluator.variables().size(); ++k) {
    if (start.psi_rho.col(static_cast<Eigen::Index>(k)).any()) continue;
    warnings.push_back(fmt::format(
        "design.variables: '{}' has a derivative of exactly 0 at the start in all that the design uses ({}); it stays "
        "as it is unless others change that",
        evaluator.scene().parameters[static_cast<std::size_t>(evaluator.variables()[k])].name,
        joined(objective_names(spec))));
  }
  return warnings;
}

double missed(const DesignConstraint& c, double value) {
  return std::max({0.0, c.lower ? *c.lower - value : 0.0, c.upper ? value - *c.upper : 0.0});
}

void describe_end(const Evaluator& evaluator, const DesignProgram& program, const NlpPoint& end, DesignResult& result) {
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
    c.at_lower = touches(c.value, c.lower, program.size(row)),
    c.at_upper = touches(c.value, c.upper, program.size(row));
  }
}

// One more look at the solution: the final evaluation, true extremes, and how stationary it is.
void describe_solution(Evaluator& evaluator, DesignProgram& program, const Eigen::VectorXd& x, DesignResult& result) {
  result.final_evaluation = program.evaluation(result.rho);
  NlpPoint end;
  end.f_x.setZero(program.variables()), end.c.setZero(program.constraints());
  end.c_x.setZero(program.constraints(), program.variables());
  program.evaluate(x, end);
  if (end.ok) result.optimality = optimality(program, x, end);
  const std::vector<std::optional<double>> true_values = evaluator.true_values(result.rho);
  result.objective_true = true_values[0];
  result.true_violation = result.violation;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    c.true_value = true_values[i + 1];
    c.true_violation = missed(c, c.true_value.value_or(c.value));
    result.true_violation =
        std::max(result.true_violation, c.true_violation / program.size(static_cast<Eigen::Index>(i)));
  }
}

// A smooth maximum is below the true one, so that a limit on it lets the true one pass.
void judge_true_extremes(const DesignProgram& program, const Evaluator& evaluator, DesignResult& result) {
  bool beyond = false;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    const DesignConstraint& c = result.constraints[i];
    const int extreme = evaluator.objectives()[i + 1].extreme();
    if (extreme == 0) continue;
    const std::string place =
        fmt::format("design.subject_to[{}]: the {} of '{}'", i, extreme > 0 ? "maximum" : "minimum", c.objective);
    if (!c.true_value) {
      beyond = true;
      result.warnings.push_back(place +
                                " is held by its smooth value only; the run that was to find the true one failed");
      continue;
    }
    const double margin = std::abs(*c.true_value - c.value);
    if (c.true_violation <= kConstraintTolerance * program.size(static_cast<Eigen::Index>(i))) continue;
    beyond = true;
    result.warnings.push_back(fmt::format(
        "{} is held by its smooth value, {:.6g}, only: the true one is {:.6g}, {} the limit {:.6g}. Bound it with a "
        "margin of about {:.2g}, or raise its sharpness",
        place, c.value, *c.true_value, c.upper && *c.true_value > *c.upper ? "above" : "below",
        c.upper && *c.true_value > *c.upper ? *c.upper : *c.lower, margin));
  }
  if (!beyond || result.status != SolverStatus::converged) return;
  result.status = SolverStatus::converged_beyond_limit;
  result.message += "; limits hold for smooth extremes only";
}

NlpResult solved(DesignProgram& program, const Eigen::VectorXd& x_start, const OptimizerSpec& spec,
                 const std::function<bool(const NlpProgress&)>& progress, PointRecords* records, DesignResult& result) {
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
    result.seed = spec.seed.value_or(drawn_seed());
    solver.seed = static_cast<std::uint32_t>(*result.seed);
  }
  solver.progress = progress;
  solver.records = records;
  return solve_with_nlopt(program, x_start, solver);
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
  const auto there = std::make_shared<Evaluator>(scene, evaluator.objectives(), names, evaluator.options());
  comparison.at = [&start, &evaluator, there](std::size_t k, double h) -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd rho = start.rho;
    rho(evaluator.variables()[k]) += h;
    const Evaluation& e = there->values(rho);
    if (!e.ok) return std::nullopt;
    return e.psi;
  };
  comparison.tighter = [&start, &evaluator, &scene, names](Eigen::VectorXd& f, Eigen::MatrixXd& f_rho) {
    std::optional<Scene> tight = with_other_tolerances(scene);
    if (!tight) return false;
    Evaluator at_tight(*std::move(tight), evaluator.objectives(), names, evaluator.options());
    const Evaluation& e = at_tight.gradients(start.rho);
    f = e.psi, f_rho = e.psi_rho;
    return e.ok;
  };
  return comparison;
}

// Forces written in C++ name bodies by their number.
Problem simulated(const Problem& problem, const DesignOptions& options) {
  return options.user_forces.empty() ? what_objectives_need(problem) : problem;
}

}  // namespace

NlpScale design_scale(const Problem& problem, const DesignOptions& options) {
  const DesignSpec& spec = checked(problem);
  EvaluatorOptions evaluator_options;
  evaluator_options.method = options.method;
  evaluator_options.user_forces = options.user_forces;
  evaluator_options.progress = options.simulation_progress;
  const Problem needed = simulated(problem, options);
  Evaluator evaluator(needed.scene, objectives_of(needed, objective_names(spec)), spec.variables, evaluator_options);
  const VariableScaling scaling(chosen(problem.scene, evaluator.variables()));
  DesignProgram program(spec, evaluator, scaling);
  program.start_from(start_of(evaluator, scaling));
  return {program.f_scale, program.c_scale};
}

DesignResult run_design(const Problem& problem, const DesignOptions& options) {
  const Stopwatch stopwatch;
  const DesignSpec& spec = checked(problem);
  EvaluatorOptions evaluator_options;
  evaluator_options.method = options.method;
  evaluator_options.user_forces = options.user_forces;
  bool abandoned = false;
  if (options.simulation_progress)
    evaluator_options.progress = [&](double t) {
      return abandoned = abandoned || !options.simulation_progress(t), !abandoned;
    };
  const Problem needed = simulated(problem, options);
  Evaluator evaluator(needed.scene, objectives_of(needed, objective_names(spec)), spec.variables, evaluator_options);
  const VariableScaling scaling(chosen(problem.scene, evaluator.variables()));
  DesignProgram program(spec, evaluator, scaling, [&] { return abandoned; });

  DesignResult result;
  result.optimizer = spec.optimizer.type;
  const Eigen::VectorXd x_start = start_of(evaluator, scaling);
  const Evaluation start = program.start_from(x_start, options.scale);
  result.scale = {program.f_scale, program.c_scale};
  result.gradient_choice = start.choice.empty() ? std::string(to_string(start.method)) : start.choice;
  describe_start(problem, evaluator, start, result);
  if (start.ok) result.warnings = idle_variables(start, spec, evaluator);
  if (start.ok && options.compare_differences) {
    DifferenceComparison comparison = comparison_at(start, evaluator);
    comparison.go_on = [&] { return !abandoned; };
    for (std::string& warning : comparison.warnings()) result.warnings.push_back("design.variables: " + warning);
  }

  const auto progress = [&](const NlpProgress& p) {
    if (abandoned) return false;  // the iterate before the one that was not reached
    result.history.push_back({p.iteration, p.f, p.violation, p.optimality, scaling.to_rho(p.x)});
    return !options.progress || options.progress(result.history.back());
  };
  const NlpResult solution = solved(program, x_start, spec.optimizer, progress, options.records, result);
  result.status = abandoned ? SolverStatus::stopped : solution.status;
  result.message = abandoned ? "stopped on request" : solution.message;
  result.algorithm = solution.algorithm;
  result.iterations = solution.iterations;
  result.evaluations = solution.evaluations, result.failed_evaluations = solution.failed_evaluations;
  result.rho = program.rho_at(solution.x);
  if (start.ok && solution.point.ok) {
    describe_end(evaluator, program, solution.point, result);
    if (!abandoned) {
      describe_solution(evaluator, program, solution.x, result);
      judge_true_extremes(program, evaluator, result);
    }
  }
  if (result.final_evaluation.statistics.jumps.empty())  // those of the solution stand beside it
    for (const Jump& jump : start.statistics.jumps)
      result.warnings.push_back("at the start, " + in_words(evaluator.scene(), jump));
  if (!program.hessian_failure().empty())
    result.warnings.push_back(
        "design.optimizer.hessian: could not be computed everywhere, where it was not the one "
        "before served again; first: " +
        program.hessian_failure());
  result.simulations = evaluator.simulations() + program.hessian_gradients();
  result.wall_seconds = stopwatch.seconds();
  return result;
}

}  // namespace mbsopt
