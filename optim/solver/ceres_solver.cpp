#include "optim/solver/ceres_solver.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <vector>

#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kInvalidSteps = 30;  // in a row; each shortens the step, the last ones to nothing
// Part of the cost of the start that the derivatives may still promise at a minimum. The noise of a simulation at
// rtol 1e-5 promises below 1e-8; in front of a wall of failed points, or with wrong derivatives, it is most of the
// cost.
constexpr double kPromise = 1e-4;

// The problem's last point is kept: Ceres asks for the residuals of a trial step first, and for the Jacobian of the
// same point once it has accepted the step.
class Evaluations {
 public:
  Evaluations(LeastSquaresProblem& problem, LeastSquaresResult& result) : problem_(problem), result_(result) {}

  const LeastSquaresProblem& problem() const { return problem_; }

  const LeastSquaresPoint& at(const Eigen::VectorXd& x) {
    if (x_.size() == x.size() && x_ == x) return point_;
    x_ = x;
    point_.ok = true, point_.message.clear();
    point_.z.setZero(problem_.size), point_.z_x.setZero(problem_.size, problem_.variables());
    ++result_.evaluations;
    try {
      problem_.evaluate(x, point_);
    } catch (const std::exception& error) {
      point_.ok = false, point_.message = error.what();
    }
    if (point_.ok && !(point_.z.allFinite() && point_.z_x.allFinite()))
      point_.ok = false, point_.message = "a residual or its derivative is not finite";
    if (point_.ok && !std::isfinite(point_.z.squaredNorm() + point_.z_x.squaredNorm()))
      point_.ok = false, point_.message = fmt::format(
                             "the squares of the residuals or of their derivatives are beyond all numbers: the largest "
                             "residual is {:.3g} (measured - model)/sigma, the largest derivative {:.3g}. Look for "
                             "values that are none in the data, and at sigma, that of priors too",
                             point_.z.lpNorm<Eigen::Infinity>(), point_.z_x.lpNorm<Eigen::Infinity>());
    if (!point_.ok) {
      ++result_.failed_evaluations;
      if (result_.first_error.empty()) result_.first_error = point_.message;
    }
    return point_;
  }

 private:
  LeastSquaresProblem& problem_;
  LeastSquaresResult& result_;
  Eigen::VectorXd x_;
  LeastSquaresPoint point_;
};

// Some rows of the residuals as a block of one vector of variables.
class Rows : public ceres::CostFunction {
 public:
  Rows(Evaluations& evaluations, Eigen::Index first, Eigen::Index count)
      : evaluations_(evaluations), first_(first), count_(count) {
    set_num_residuals(static_cast<int>(count));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(evaluations.problem().variables()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index n = evaluations_.problem().variables();
    const LeastSquaresPoint& point = evaluations_.at(Eigen::Map<const Eigen::VectorXd>(parameters[0], n));
    if (!point.ok) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, count_) = point.z.segment(first_, count_);
    if (jacobians && jacobians[0]) Eigen::Map<RowMajor>(jacobians[0], count_, n) = point.z_x.middleRows(first_, count_);
    return true;
  }

 private:
  Evaluations& evaluations_;
  Eigen::Index first_, count_;
};

class CeresLoss : public ceres::LossFunction {
 public:
  explicit CeresLoss(const Loss& loss) : loss_(loss) {}
  void Evaluate(double z_squared, double out[3]) const override {
    const LossValue v = loss_.at(z_squared);
    out[0] = v.rho, out[1] = v.rho1, out[2] = v.rho2;
  }

 private:
  const Loss loss_;
};

// Counts iterations over several calls of the solver, each of which reports its start as iteration 0.
class Progress : public ceres::IterationCallback {
 public:
  Progress(const CeresOptions& options, const Eigen::VectorXd& x) : options_(options), x_(x) {}

  const Eigen::VectorXd& last() const { return last_; }  // accepted; Ceres itself forgets it when it is stopped
  int iterations() const { return std::max(0, count_); }
  int left() const { return options_.max_iterations - iterations(); }
  // Refused steps have raised the damping diag(J'J)/radius above J'J itself.
  bool damped() const { return radius_ < 1; }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    if (s.iteration == 0 || s.step_is_successful) cost_ = s.cost;  // else it is the cost of the step that was refused
    if (s.iteration == 0 && count_ >= 0) return ceres::SOLVER_CONTINUE;  // the point just reported
    ++count_;
    last_ = x_, radius_ = s.trust_region_radius;
    if (!options_.progress) return ceres::SOLVER_CONTINUE;
    const bool go_on = options_.progress({count_, cost_, s.gradient_max_norm, s.step_norm, x_});
    return go_on ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }

 private:
  const CeresOptions& options_;
  const Eigen::VectorXd& x_;  // Ceres keeps it at the last accepted point
  Eigen::VectorXd last_;
  double cost_ = 0;  // there
  double radius_ = std::numeric_limits<double>::infinity();
  int count_ = -1;
};

ceres::Solver::Options solver_options(const CeresOptions& options) {
  ceres::Solver::Options o;
  o.minimizer_type = ceres::TRUST_REGION;
  o.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  o.linear_solver_type = ceres::DENSE_QR;
  o.num_threads = 1;
  o.max_num_iterations = options.max_iterations;
  o.function_tolerance = options.tolerance;
  o.parameter_tolerance = options.tolerance;
  o.gradient_tolerance = 1e-14;
  o.max_num_consecutive_invalid_steps = kInvalidSteps;
  o.logging_type = ceres::SILENT;
  o.minimizer_progress_to_stdout = false;
  o.update_state_every_iteration = true;
  return o;
}

// Variables at a bound that the cost would fall beyond.
std::vector<int> pressed_bounds(const LeastSquaresProblem& problem, const Eigen::VectorXd& x,
                                const Eigen::VectorXd& g) {
  std::vector<int> pressed;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    if ((x(k) <= problem.x_lower(k) && g(k) > 0) || (x(k) >= problem.x_upper(k) && g(k) < 0))
      pressed.push_back(static_cast<int>(k));
  return pressed;
}

// Returns how far the best step along one free variable lowers the cost by the derivatives, a lower bound of the rest.
double promised_gain(const LeastSquaresProblem& problem, const Eigen::VectorXd& x, const LeastSquaresPoint& at) {
  const Eigen::VectorXd g = at.z_x.transpose() * problem.pull(at.z);
  Eigen::VectorXd gain = g.array().square() / (2 * at.z_x.colwise().squaredNorm().transpose().array()).max(1e-300);
  for (const int k : pressed_bounds(problem, x, g)) gain(k) = 0;
  return gain.size() > 0 ? gain.maxCoeff() : 0;
}

// A loss sees each residual by itself; without one all are a single block. The problem owns the blocks.
void add_residuals(ceres::Problem& ceres_problem, Evaluations& evaluations, ceres::LossFunction* loss, double* x) {
  const LeastSquaresProblem& problem = evaluations.problem();
  const Eigen::Index robust = loss ? problem.size - problem.plain : 0;
  for (Eigen::Index i = 0; i < robust; ++i) ceres_problem.AddResidualBlock(new Rows(evaluations, i, 1), loss, x);
  if (robust < problem.size)
    ceres_problem.AddResidualBlock(new Rows(evaluations, robust, problem.size - robust), nullptr, x);
}

void solve(Evaluations& evaluations, const std::vector<int>& held, const CeresOptions& options, Progress& progress,
           Eigen::VectorXd& x, ceres::Solver::Summary& summary) {
  const LeastSquaresProblem& problem = evaluations.problem();
  CeresLoss loss(problem.loss);
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(ownership);
  add_residuals(ceres_problem, evaluations, problem.loss.type == LossType::squared ? nullptr : &loss, x.data());
  const int n = static_cast<int>(x.size());
  for (int k = 0; k < n; ++k) {
    if (std::isfinite(problem.x_lower(k))) ceres_problem.SetParameterLowerBound(x.data(), k, problem.x_lower(k));
    if (std::isfinite(problem.x_upper(k))) ceres_problem.SetParameterUpperBound(x.data(), k, problem.x_upper(k));
  }
  if (!held.empty()) ceres_problem.SetManifold(x.data(), new ceres::SubsetManifold(n, held));  // the problem owns it
  ceres::Solver::Options solver = solver_options(options);
  solver.max_num_iterations = std::max(0, progress.left());
  solver.callbacks.push_back(&progress);
  ceres::Solve(solver, &ceres_problem, &summary);
}

void set_outcome(const ceres::Solver::Summary& summary, const CeresOptions& options, LeastSquaresResult& result) {
  const std::string failures = result.failures();
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
    case ceres::USER_SUCCESS:
      result.status = SolverStatus::converged;
      result.message =
          fmt::format("converged: cost and parameters change by less than {:g} of themselves", options.tolerance);
      return;
    case ceres::NO_CONVERGENCE:
      result.status = SolverStatus::iteration_limit;
      result.message =
          fmt::format("stopped at the limit of {}{}", counted(options.max_iterations, "iteration"), failures);
      return;
    case ceres::USER_FAILURE:
      result.status = SolverStatus::stopped;
      result.message = "stopped on request";
      return;
    case ceres::FAILURE:
      break;
  }
  result.status = SolverStatus::failed;
  result.message = fmt::format("failed: {}{}", summary.message, failures);
}

}  // namespace

LeastSquaresResult solve_with_ceres(LeastSquaresProblem& problem, const Eigen::VectorXd& x_start,
                                    const CeresOptions& options) {
  LeastSquaresResult result;
  result.x = x_start;
  Evaluations evaluations(problem, result);
  const LeastSquaresPoint start = evaluations.at(x_start);
  if (!start.ok) {
    result.message = "the start point cannot be evaluated: " + start.message;
    return result;
  }
  result.z_initial = start.z;
  result.cost_initial = problem.cost(start.z);
  if (!std::isfinite(result.cost_initial)) {
    result.message = "the start point cannot be evaluated: the loss of its residuals is not finite";
    return result;
  }

  // Ceres projects steps onto the bounds, which is slow along an active one: variables that press against their bound
  // are held there, until nothing changes.
  Eigen::VectorXd x = x_start;
  Progress progress(options, x);
  ceres::Solver::Summary summary;
  std::vector<int> held;
  for (Eigen::Index round = 0; round <= 2 * x.size(); ++round) {
    solve(evaluations, held, options, progress, x, summary);
    result.iterations = progress.iterations();
    if (summary.termination_type != ceres::CONVERGENCE) break;
    const LeastSquaresPoint& at = evaluations.at(x);
    std::vector<int> pressed = at.ok ? pressed_bounds(problem, x, at.z_x.transpose() * problem.pull(at.z)) : held;
    if (pressed == held || static_cast<Eigen::Index>(pressed.size()) == x.size()) break;
    held = std::move(pressed);
  }

  set_outcome(summary, options, result);
  if (summary.termination_type != ceres::CONVERGENCE && progress.last().size() > 0) x = progress.last();
  const LeastSquaresPoint& end = evaluations.at(x);
  result.x = end.ok ? x : x_start;
  result.point = end.ok ? end : start;
  result.cost_final = problem.cost(result.point.z);
  // Ceres takes steps that were shortened to nothing for convergence.
  const double promise = promised_gain(problem, result.x, result.point);
  if (result.status == SolverStatus::converged && progress.damped() && promise > kPromise * result.cost_initial) {
    result.status = SolverStatus::no_progress;
    result.message = fmt::format(
        "no further progress: the derivatives promise to lower the cost by {:.2g}, but no step lowers it{}. Tighten "
        "rtol of the integrator; check the derivatives of C++ code",
        promise, result.failures());
  }
  return result;
}

}  // namespace mbsopt
