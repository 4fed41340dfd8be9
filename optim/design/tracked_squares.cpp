#include "optim/design/tracked_squares.hpp"

#include <cmath>
#include <limits>
#include <map>

#include "core/mechanism/scene_programs.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

const std::vector<Objective::Sample>& residuals_of(const CaseEvaluator& evaluator, std::size_t load_case) {
  return evaluator.of_case(load_case).objectives()[0].residuals();
}

Index residuals(const CaseEvaluator& evaluator) {
  std::size_t count = 0;
  for (std::size_t c = 0; c < evaluator.cases(); ++c) count += residuals_of(evaluator, c).size();
  return static_cast<Index>(count);
}

}  // namespace

TrackedSquares::TrackedSquares(const DesignProgram& program, const CaseEvaluator& evaluator)
    : LeastSquaresProblem(program.variables(), residuals(evaluator)), program_(program), evaluator_(evaluator) {
  x_lower = program.x_lower, x_upper = program.x_upper;
}

void TrackedSquares::evaluate(const VectorXd& x, LeastSquaresPoint& point) {
  const VectorXd rho = program_.rho_at(x), rho_x = program_.scaling().rho_x(x);
  const VectorXd weights = program_.objective().gradient(VectorXd::Zero(static_cast<Index>(evaluator_.cases())));
  Index first = 0;
  for (std::size_t c = 0; c < evaluator_.cases(); ++c) {
    const Evaluator& evaluator = evaluator_.of_case(c);
    const std::vector<Objective::Sample>& rows = residuals_of(evaluator_, c);
    std::vector<bool> active(evaluator.scene().parameters.size(), false);
    for (const int k : evaluator.variables()) active[static_cast<std::size_t>(k)] = true;
    const Mechanism mechanism(evaluator.scene(), rho, active, evaluator.options().user_forces, evaluator.programs());
    std::map<const void*, std::shared_ptr<const PointCost>> bound;  // rows of a file share an expression
    TangentSampling sampling;
    std::vector<const PointCost*> costs;
    for (const Objective::Sample& row : rows) {
      std::shared_ptr<const PointCost>& cost = bound[row.value.id()];
      if (!cost) cost = row.value.bind(mechanism);
      costs.push_back(cost.get()), sampling.times.push_back(row.time);
    }
    const double weight = std::sqrt(weights(static_cast<Index>(c)));
    VectorXd y_bar(mechanism.states()), rho_bar(rho.size());
    sampling.observe = [&](std::size_t k, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
      y_bar.setZero(), rho_bar.setZero();
      const Index row = first + static_cast<Index>(k);
      point.z(row) = weight * costs[k]->add_gradient(at, 1, y_bar, rho_bar);
      for (Index j = 0; j < x.size(); ++j) {
        const int parameter = evaluator.variables()[static_cast<std::size_t>(j)];
        point.z_x(row, j) = weight * rho_x(j) * (y_bar.dot(y_rho.col(parameter)) + rho_bar(parameter));
      }
    };
    ++simulations_;
    const SimulationResult run =
        simulate_tlm(mechanism, evaluator.scene().simulation, {}, sampling, {nullptr, evaluator.options().progress});
    if (!run.ok()) {
      point.ok = false, point.message = run.message;
      return;
    }
    first += static_cast<Index>(rows.size());
  }
}

NlpResult solve_tracked_squares(DesignProgram& program, const CaseEvaluator& evaluator, const VectorXd& x_start,
                                const OptimizerSpec& spec, const std::function<bool(const NlpProgress&)>& progress,
                                long& simulations) {
  TrackedSquares problem(program, evaluator);
  LeastSquaresOptions options;
  options.tolerance = std::min(options.tolerance, spec.tolerance);
  if (spec.max_iterations) options.max_iterations = static_cast<int>(*spec.max_iterations);
  options.progress = [&](const LeastSquaresProgress& p) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    return !progress || progress({p.iteration, 2 * p.cost, 0, kUnknown, p.x});
  };
  NlpResult result;
  static_cast<SolverOutcome&>(result) = solve_least_squares(problem, x_start, options);
  result.algorithm = "Levenberg-Marquardt within bounds";
  simulations += problem.simulations();
  NlpPoint& point = result.point;
  point.f_x.setZero(program.variables()), point.c.setZero(0), point.c_x.setZero(0, program.variables());
  program.evaluate(result.x, point);
  return result;
}

}  // namespace mbsopt
