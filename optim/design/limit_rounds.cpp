#include "optim/design/limit_rounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "optim/design/tracked_squares.hpp"
#include "optim/design/true_limits.hpp"
#include "optim/problem/start_points.hpp"
#include "optim/solver/ipopt_solver.hpp"
#include "optim/solver/nlopt_methods.hpp"
#include "optim/solver/nlopt_solver.hpp"
#include "optim/solver/optimality.hpp"
#include "optim/solver/sqp_solver.hpp"

namespace mbsopt::inline optim {
namespace {

// The options of every solver of nonlinear programs.
template <class Options>
Options common_options(const OptimizerSpec& spec, const SearchHooks& hooks) {
  Options solver;
  solver.tolerance = spec.tolerance;
  solver.constraint_tolerance = kConstraintTolerance;
  solver.max_evaluations = spec.max_evaluations;
  if (spec.lbfgs_history) solver.history = static_cast<decltype(solver.history)>(*spec.lbfgs_history);
  solver.progress = hooks.progress;
  return solver;
}

NlpResult solved_with_ipopt(DesignProgram& program, const Eigen::VectorXd& x_start, const OptimizerSpec& spec,
                            const SearchHooks& hooks) {
  IpoptOptions solver = common_options<IpoptOptions>(spec, hooks);
  solver.max_iterations = static_cast<int>(spec.max_iterations.value_or(OptimizerSpec::kIpoptIterations));
  solver.second_order = spec.hessian != "lbfgs";
  solver.gauss_newton = spec.hessian == "gauss_newton";
  solver.warm_start = spec.warm_start;
  NlpResult solution = solve_with_ipopt(program, x_start, solver);
  if (solver.second_order)
    solution.algorithm = fmt::format("Ipopt: interior point, {} Hessian",
                                     spec.hessian == "exact" ? "exact" : "generalised Gauss-Newton");
  return solution;
}

NlpResult solved_with_sqp(DesignProgram& program, const Eigen::VectorXd& x_start, const OptimizerSpec& spec,
                          const SearchHooks& hooks) {
  SqpOptions solver;
  solver.tolerance = spec.tolerance;
  solver.constraint_tolerance = kConstraintTolerance;
  solver.max_evaluations = spec.max_evaluations;
  solver.progress = hooks.progress;
  if (spec.max_iterations) solver.max_iterations = static_cast<int>(*spec.max_iterations);
  solver.has_hessians = program.has_squares();
  return solve_with_sqp(program, x_start, solver);
}

NlpResult solved_with_nlopt(DesignProgram& program, const Eigen::VectorXd& x_start, const OptimizerSpec& spec,
                            const SearchHooks& hooks, std::optional<long>& seed) {
  NloptOptions solver = common_options<NloptOptions>(spec, hooks);
  solver.method = spec.type;
  solver.max_iterations = spec.max_iterations;
  if (find_nlopt_method(spec.type)->random) {
    if (!seed) seed = spec.seed.value_or(drawn_seed());
    solver.seed = static_cast<std::uint32_t>(*seed);
  }
  return solve_with_nlopt(program, x_start, solver);
}

NlpResult solved_once(DesignProgram& program, const Eigen::VectorXd& x_start, const OptimizerSpec& spec,
                      const SearchHooks& hooks, DesignResult& result) {
  if (spec.type == OptimizerSpec::kLeastSquares)
    return solve_tracked_squares(program, x_start, spec, hooks.progress, result.simulations);
  if (spec.is_sqp()) return solved_with_sqp(program, x_start, spec, hooks);
  if (spec.asks_for_ipopt()) return solved_with_ipopt(program, x_start, spec, hooks);
  return solved_with_nlopt(program, x_start, spec, hooks, result.seed);
}

// Returns what an optimiser may still spend after earlier rounds. A global method searches as long in every round.
OptimizerSpec remaining(OptimizerSpec spec, const NlpResult& done) {
  const NloptMethod* const method = find_nlopt_method(spec.type);
  if (method && method->global) return spec;
  if (spec.asks_for_ipopt()) spec.max_iterations = spec.max_iterations.value_or(OptimizerSpec::kIpoptIterations);
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
  const auto violations = [&](const NlpResult& r) {
    return program.sum_of_violations(r.point.c, kConstraintTolerance);
  };
  return found.point.ok && is_better(found.point.f, violations(found), before.point.f, violations(before));
}

// The hooks of a later round, whose iterations follow those of the rounds before.
SearchHooks continued(const SearchHooks& hooks, int iterations) {
  SearchHooks later = hooks;
  later.progress = [progress = hooks.progress, iterations](NlpProgress p) {
    if (p.iteration == 0) return true;  // known from before
    p.iteration += iterations;
    return progress(p);
  };
  return later;
}

// One search more, from x, with what the optimiser may still spend; none if that is nothing. Counts those before, too.
std::optional<NlpResult> searched_again(DesignProgram& program, const Eigen::VectorXd& x_start, bool warm,
                                        const SearchHooks& hooks, const NlpResult& done, DesignResult& result) {
  OptimizerSpec rest = remaining(program.spec().optimizer, done);
  if (!may_go_on(rest)) return std::nullopt;
  rest.warm_start = warm || rest.warm_start;
  NlpResult found = solved_once(program, x_start, rest, continued(hooks, done.iterations), result);
  found.iterations += done.iterations;
  found.evaluations += done.evaluations;
  found.failed_evaluations += done.failed_evaluations;
  return found;
}

// A search that stalls with the curvature that it has learnt may go on without it.
NlpResult solved(DesignProgram& program, const SearchHooks& hooks, DesignResult& result) {
  constexpr int kFreshStarts = 2;
  NlpResult solution = solved_once(program, program.x_start(), program.spec().optimizer, hooks, result);
  for (int k = 0; k < kFreshStarts && solution.status == SolverStatus::no_progress; ++k) {
    std::optional<NlpResult> found = searched_again(program, solution.x, true, hooks, solution, result);
    if (!found) break;
    if (!is_an_improvement(program, *found, solution)) {
      solution.take_counts(*found);
      if (found->status == SolverStatus::stopped) solution.end_on_request();
      break;
    }
    solution = *std::move(found);
  }
  return solution;
}

// Solves again within the moved bounds, from the last solution. If the method stalls there, it solves from the first
// start.
void solve_again(DesignProgram& program, const SearchHooks& hooks, NlpResult& solution, DesignResult& result) {
  for (const bool from_solution : {true, false}) {
    const Eigen::VectorXd& x_start = from_solution ? solution.x : program.x_start();
    std::optional<NlpResult> found = searched_again(program, x_start, from_solution, hooks, solution, result);
    if (!found)
      return solution.end(
          SolverStatus::iteration_limit,
          "stopped at the limit of iterations or evaluations, before the limits held for true extremes");
    if (from_solution || is_an_improvement(program, *found, solution))
      solution = *std::move(found);
    else
      solution.take_counts(*found);
    if (solution.status != SolverStatus::no_progress && solution.status != SolverStatus::infeasible) return;
  }
}

// The side on which each constraint holds the objective back, if the method has derivatives and can hold equalities.
Eigen::VectorXi binding_sides(const OptimizerSpec& spec, const DesignProgram& program, const NlpResult& solution) {
  const NloptMethod* const method = find_nlopt_method(spec.type);
  Eigen::VectorXi sides = Eigen::VectorXi::Zero(program.constraints());
  const bool holds_equalities = spec.asks_for_ipopt() || (method && method->gradients && !method->global &&
                                                          method->constraints != ConstraintSupport::inequalities);
  if (!holds_equalities) return sides;
  const Stationarity found = stationarity(program, solution.x, solution.point);
  for (Eigen::Index i = 0; i < sides.size(); ++i)
    if (found.binds(i, spec.tolerance)) sides(i) = found.multipliers(i) > 0 ? 1 : -1;
  return sides;
}

}  // namespace

LimitedSolution solve_in_rounds(DesignProgram& program, const SearchHooks& hooks, DesignResult& result) {
  const OptimizerSpec& optimizer = program.spec().optimizer;
  TrueLimits limits(program);
  LimitedSolution rounds;
  NlpResult& solution = rounds.solution;
  solution = solved(program, hooks, result);
  while (solution.point.ok && !hooks.abandoned()) {
    rounds.true_values = program.evaluator().true_values(program.rho_at(solution.x));
    if (!is_an_end(solution.status) || optimizer.is_sqp()) break;
    const TrueLimits limits_before = limits;
    if (!limits.move(program, solution.point.c, rounds.true_values, binding_sides(optimizer, program, solution))) break;
    NlpResult before = solution;
    solve_again(program, hooks, solution, result);
    const bool as_good = solution.status == SolverStatus::converged || solution.status == before.status;
    if (as_good || !limits_before.hold(program, rounds.true_values)) continue;
    before.take_counts(solution);  // the limits held there
    if (solution.status == SolverStatus::stopped) before.end_on_request();
    solution = std::move(before);
    limits = limits_before;
    break;
  }
  result.limit_rounds = limits.rounds();
  limits.set_inequalities(program);
  rounds.slopes.resize(program.constraints());
  for (Eigen::Index i = 0; i < program.constraints(); ++i) rounds.slopes(i) = limits.slope(i);
  return rounds;
}

}  // namespace mbsopt::inline optim
