#include "optim/design/tracked_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "core/driven/driven_simulation.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/run/run_arguments.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr const char* kNoValue =
    "a residual or its derivative is not a number: a tracked weight is negative, or a sensor has no value";

const Objective& minimised(const Evaluator& evaluator, std::size_t load_case) {
  return evaluator.of_case(load_case).objectives()[0];
}

Index residuals(const Evaluator& evaluator) {
  std::size_t count = 0;
  for (std::size_t c = 0; c < evaluator.cases(); ++c) count += minimised(evaluator, c).residuals().size();
  return static_cast<Index>(count);
}

// Takes out of the rows of each block of points what its instant can change: z_x -= z_t (z_t' z_x)/(z_t' z_t). L.
// Kaufman, "A variable projection method for solving separable nonlinear least squares problems", BIT 15 (1975) 49-57.
void project_free_instants(const Objective& objective, const std::vector<Objective::Instant>& instants, Index first,
                           const VectorXd& z_t, Eigen::MatrixXd& z_x) {
  std::map<std::size_t, std::vector<Index>> rows_of_block;
  for (std::size_t i = 0; i < instants.size(); ++i)
    if (instants[i].block && objective.free_instants()->is_inside(instants[i].time))
      rows_of_block[*instants[i].block].push_back(static_cast<Index>(i));
  for (const auto& [block, rows] : rows_of_block) {
    const VectorXd along = z_t(rows);
    const double square = along.squaredNorm();
    if (square == 0) continue;  // a dwell
    std::vector<Index> in_all = rows;
    for (Index& row : in_all) row += first;
    const Eigen::RowVectorXd moved = along.transpose() * z_x(in_all, Eigen::all) / square;
    z_x(in_all, Eigen::all) -= along * moved;
  }
}

}  // namespace

TrackedSquares::TrackedSquares(const DesignProgram& program)
    : LeastSquaresProblem(program.variables(), residuals(program.evaluator())),
      program_(program),
      evaluator_(program.evaluator()) {
  x_lower = program.x_lower;
  x_upper = program.x_upper;
}

void TrackedSquares::evaluate(const VectorXd& x, LeastSquaresPoint& point) {
  simulate(x, point);
  is_integrated = !is_solved_;
  if (abandoned_) return;
  if (point.ok && !(point.z.allFinite() && point.z_x.allFinite())) {
    point.ok = false;
    point.message = kNoValue;
  }
  without_value_ = without_value_ || point.message == kNoValue;
}

// Residuals read no rates of the state, so that a solved run goes without the equations of motion. Once a run has begun
// in the mode of its guess, a jump to another mode is a failure.
SimulationResult TrackedSquares::with_tangents(const Mechanism& mechanism, const SimulationSettings& settings,
                                               const TangentSampling& sampling, const RunOptions& options) {
  if (is_solved_) {
    check_run_arguments(mechanism, settings, {}, sampling.times, options);
    const Assembly start(mechanism, settings.start_time, modes_);
    if (!start.result().ok) {
      SimulationResult failed;
      failed.status = SimulationStatus::assembly_failed;
      failed.message = start.result().message;
      return failed;
    }
    if (is_solved(mechanism, settings, start)) {
      if (start.result().in_mode) modes_ = Modes::of_guess;
      return driven_tlm(mechanism, settings, {}, sampling, options, start,
                        reads_velocities_ ? Rates::unknown : Rates::without_tangents);
    }
    is_solved_ = false;
  }
  return simulate_tlm(mechanism, settings, {}, sampling, options);
}

void TrackedSquares::simulate(const VectorXd& x, LeastSquaresPoint& point) {
  const auto go_on = [&, &progress = evaluator_.options().progress](double t) {
    abandoned_ = abandoned_ || (progress && !progress(t));
    return !abandoned_;
  };
  const VectorXd rho = program_.rho_at(x), rho_x = program_.scaling().rho_x(x);
  const VectorXd weights = program_.objective().gradient(VectorXd::Zero(static_cast<Index>(evaluator_.cases())));
  Index first = 0;
  for (std::size_t c = 0; c < evaluator_.cases(); ++c) {
    const Evaluator& evaluator = evaluator_.of_case(c);
    const Objective& objective = minimised(evaluator_, c);
    const std::vector<Objective::Sample>& rows = objective.residuals();
    const Mechanism mechanism = evaluator.mechanism(rho, true);
    const std::vector<Objective::Instant> instants = objective.instants_of(rows, mechanism, go_on);
    const double factor = std::sqrt(weights(static_cast<Index>(c)));
    std::vector<std::size_t> order(rows.size());  // by time
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return instants[i].time; });
    std::map<const void*, std::shared_ptr<const PointCost>> bound;  // rows of a file share an expression
    TangentSampling sampling;
    for (const std::size_t i : order) {
      std::shared_ptr<const PointCost>& cost = bound[rows[i].value.id()];
      if (!cost) cost = rows[i].value.bind(mechanism);
      sampling.times.push_back(instants[i].time);
    }
    const Index half = mechanism.states() / 2;
    VectorXd y_bar(mechanism.states()), rho_bar(rho.size()), z_t(static_cast<Index>(rows.size()));
    bool reads_velocities = false;
    sampling.observe = [&](std::size_t k, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
      y_bar.setZero();
      rho_bar.setZero();
      const Index row = static_cast<Index>(order[k]);
      point.z(first + row) = factor * bound[rows[order[k]].value.id()]->add_gradient(at, 1, y_bar, rho_bar);
      reads_velocities = reads_velocities || y_bar.tail(half).any();
      z_t(row) = factor * y_bar.head(half).dot(at.y.tail(half));
      for (Index j = 0; j < x.size(); ++j) {
        const int parameter = evaluator.variables()[static_cast<std::size_t>(j)];
        point.z_x(first + row, j) = factor * rho_x(j) * (y_bar.dot(y_rho.col(parameter)) + rho_bar(parameter));
      }
    };
    ++simulations_;
    const SimulationResult run = with_tangents(mechanism, evaluator.scene().simulation, sampling, {nullptr, go_on});
    if (!run.ok()) {
      point.ok = false;
      point.message = run.message;
      return;
    }
    if (reads_velocities && !reads_velocities_) {  // the run must compute their derivatives, too
      reads_velocities_ = true;
      point.z.setZero();
      point.z_x.setZero();
      return simulate(x, point);
    }
    project_free_instants(objective, instants, first, z_t, point.z_x);
    first += static_cast<Index>(rows.size());
  }
}

NlpResult solve_tracked_squares(DesignProgram& program, const VectorXd& x_start, const OptimizerSpec& spec,
                                const std::function<bool(const NlpProgress&)>& progress, long& simulations) {
  TrackedSquares problem(program);
  LeastSquaresOptions options;
  options.tolerance *= spec.tolerance / OptimizerSpec{}.tolerance;  // the default of one is that of the other
  if (spec.max_iterations) options.max_iterations = static_cast<int>(*spec.max_iterations);
  options.max_evaluations = spec.max_evaluations;
  options.progress = [&](const LeastSquaresProgress& p) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    return !problem.abandoned() && (!progress || progress({p.iteration, 2 * p.cost, 0, kUnknown, p.x}));
  };
  LeastSquaresResult found = solve_least_squares(problem, x_start, options);
  if (problem.abandoned()) {
    --found.evaluations;
    --found.failed_evaluations;
  }
  if (found.status == SolverStatus::converged && problem.without_value() && found.promised > kSimulationNoise) {
    found.status = SolverStatus::no_progress;
    found.message =
        "no further progress: the steps lead to where a tracked weight is negative, or a sensor has no value" +
        found.failures();
  }
  NlpResult result;
  static_cast<SolverOutcome&>(result) = found;
  result.algorithm = "Levenberg-Marquardt within bounds";
  simulations += problem.simulations();
  NlpPoint& point = result.point;
  point.c_x.setZero(0, program.variables());
  point.ok = found.point.z.size() == problem.size;  // not where the start could not be evaluated
  if (!point.ok) {
    point.message = found.message;
    return result;
  }
  point.f = found.point.z.squaredNorm();
  point.f_x = 2 * found.point.z_x.transpose() * found.point.z;
  return result;
}

}  // namespace mbsopt::inline optim
