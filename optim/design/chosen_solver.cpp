#include "optim/design/chosen_solver.hpp"

#include <fmt/format.h>

#include <optional>

#include "optim/design/tracked_squares.hpp"
#include "optim/problem/start_points.hpp"
#include "optim/solver/ipopt_solver.hpp"
#include "optim/solver/nlopt_methods.hpp"
#include "optim/solver/nlopt_solver.hpp"
#include "optim/solver/sqp_solver.hpp"

namespace mbsopt::inline optim {
namespace {

// The options of every solver of nonlinear programs.
template <class Options>
Options common_options(const OptimizerSpec& spec, const SearchProgress& progress) {
  Options solver;
  solver.tolerance = spec.tolerance;
  solver.constraint_tolerance = kConstraintTolerance;
  solver.max_evaluations = spec.max_evaluations;
  if (spec.lbfgs_history) solver.history = static_cast<decltype(solver.history)>(*spec.lbfgs_history);
  solver.progress = progress;
  return solver;
}

NlpResult solved_with_ipopt(DesignProgram& program, const OptimizerSpec& spec, const SearchProgress& progress) {
  IpoptOptions solver = common_options<IpoptOptions>(spec, progress);
  solver.max_iterations = static_cast<int>(spec.max_iterations.value_or(OptimizerSpec::kIpoptIterations));
  solver.second_order = spec.hessian != "lbfgs";
  solver.gauss_newton = spec.hessian == "gauss_newton";
  solver.warm_start = spec.warm_start;
  NlpResult solution = solve_with_ipopt(program, program.x_start(), solver);
  if (solver.second_order)
    solution.algorithm = fmt::format("Ipopt: interior point, {} Hessian",
                                     spec.hessian == "exact" ? "exact" : "generalised Gauss-Newton");
  return solution;
}

NlpResult solved_with_sqp(DesignProgram& program, const OptimizerSpec& spec, const SearchProgress& progress) {
  SqpOptions solver;
  solver.tolerance = spec.tolerance;
  solver.constraint_tolerance = kConstraintTolerance;
  solver.max_evaluations = spec.max_evaluations;
  solver.progress = progress;
  if (spec.max_iterations) solver.max_iterations = static_cast<int>(*spec.max_iterations);
  solver.has_hessians = program.has_squares();
  return solve_with_sqp(program, program.x_start(), solver);
}

NlpResult solved_with_nlopt(DesignProgram& program, const OptimizerSpec& spec, const SearchProgress& progress,
                            std::optional<long>& seed) {
  NloptOptions solver = common_options<NloptOptions>(spec, progress);
  solver.method = spec.type;
  solver.max_iterations = spec.max_iterations;
  if (find_nlopt_method(spec.type)->random) {
    if (!seed) seed = spec.seed.value_or(drawn_seed());
    solver.seed = static_cast<std::uint32_t>(*seed);
  }
  return solve_with_nlopt(program, program.x_start(), solver);
}

}  // namespace

NlpResult solve(DesignProgram& program, const SearchProgress& progress, DesignResult& result) {
  const OptimizerSpec& spec = program.spec().optimizer;
  if (spec.type == OptimizerSpec::kLeastSquares)
    return solve_tracked_squares(program, program.x_start(), spec, progress, result.simulations);
  if (spec.is_sqp()) return solved_with_sqp(program, spec, progress);
  if (spec.asks_for_ipopt()) return solved_with_ipopt(program, spec, progress);
  return solved_with_nlopt(program, spec, progress, result.seed);
}

}  // namespace mbsopt::inline optim
