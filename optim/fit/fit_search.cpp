#include "optim/fit/fit_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "optim/solver/multipliers.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kGuess = 1e-4;        // tolerance of a search that only gives a start to the next one
constexpr double kSameOptimum = 1e-4;  // of log L, which tells nothing below 1
constexpr double kLinear = 1e-6;       // of a change of the residuals: errors of the integration
constexpr double kFarApart = 0.1;      // a change of the residuals over their size that shows whether they are linear

// Tukey's loss has no pull far out, so that a start there would find nothing: Huber's estimate comes first.
template <class Estimate>
LeastSquaresResult estimates_of(const Loss& loss, const ExperimentStack& stack, Estimate&& estimate) {
  const Eigen::VectorXd start = stack.start();
  if (loss.type != LossType::tukey) return estimate(loss, start);
  LeastSquaresResult first = estimate(Loss{LossType::huber}, start);
  if (first.status == SolverStatus::failed || first.status == SolverStatus::stopped) return first;
  return estimate(loss, first.x);
}

// The stack with residuals that are linear about a solution: z = z* + J (x - x*), by the sigmas of the stack.
class LinearStack : public LeastSquaresProblem {
 public:
  LinearStack(const ExperimentStack& stack, const LeastSquaresResult& about)
      : LeastSquaresProblem(stack.variables(), stack.size), stack_(stack), about_(about), sigma_(stack.sigma()) {
    x_lower = stack.x_lower;
    x_upper = stack.x_upper;
    plain = stack.plain;
    parts = stack.parts;
  }

  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) override {
    point.z = about_.point.z + about_.point.z_x * (x - about_.x);
    point.z_x = about_.point.z_x;
    const Eigen::ArrayXd factor = sigma_.cwiseQuotient(stack_.sigma()).array();
    point.z.head(factor.size()).array() *= factor;
    point.z_x.topRows(factor.size()).array().colwise() *= factor;
  }

 private:
  const ExperimentStack& stack_;
  const LeastSquaresResult& about_;
  const Eigen::VectorXd sigma_;
};

}  // namespace

LeastSquaresResult FitSearch::minimised(const Eigen::VectorXd& x, double loosest) {
  LeastSquaresOptions solver = solver_options(fit_);
  solver.tolerance = std::max(solver.tolerance, loosest);
  const Eigen::VectorXd sigma = stack_.sigma();
  const int before = fit_.result.iterations;
  solver.progress = [&](const LeastSquaresProgress& p) {
    if (p.iteration == 0 && !fit_.result.history.empty()) return true;  // where the iterations so far ended
    if (apart_.empty() || cost_changes()) {
      apart_.push_back(p.z);
      apart_.back().head(stack_.samples()).array() *= sigma.array();
    }
    fit_.result.history.push_back({before + p.iteration, p.cost, p.gradient_norm, p.step_norm,
                                   stack_.scaling().to_rho(p.x), fit_.result.simulations + stack_.simulations()});
    return !fit_.options.progress || fit_.options.progress(fit_.result.history.back());
  };
  LeastSquaresResult solution = solve_with_equalities(stack_, x, solver);
  fit_.result.iterations += solution.iterations;
  fit_.result.evaluations += solution.evaluations;
  fit_.result.failed_evaluations += solution.failed_evaluations;
  return solution;
}

// The estimate under a loss, with the sigmas that it estimates.
LeastSquaresResult FitSearch::estimate(const Loss& loss, const Eigen::VectorXd& x) {
  stack_.loss = loss;
  if (!estimates_sigma(fit_.spec)) return minimised(x);
  return loss.type == LossType::squared ? best_without_sigmas(x) : in_turn_with_sigmas(x);
}

// The better one of two optima of the likelihood (sigma_estimation.hpp). A search that ends elsewhere leaves no
// history.
LeastSquaresResult FitSearch::best_without_sigmas(const Eigen::VectorXd& x) {
  const std::vector<double> given = sigmas_.sigmas(), noise = sigmas_.noise();
  LeastSquaresResult free = without_sigmas(x);
  if (!fit_.sigmas_are_estimated || fit_.options.preflight) return free;
  const std::vector<double> found = sigmas_.sigmas();
  if (std::ranges::equal(found, noise, [](double s, double least) { return s <= kNoisy * least; })) return free;
  const double likelihood = sigmas_.likelihood(free.point.z);
  const std::size_t rows = fit_.result.history.size();
  std::vector<double> first = noise;
  for (std::size_t g = 0; g < first.size(); ++g)
    if (sigmas_.is_given(g)) first[g] = given[g];
  const std::optional<Eigen::VectorXd> known = released_if_linear(free, first, x);
  if (known && known->size() == 0) return free;
  sigmas_.set(first);
  LeastSquaresResult released = without_sigmas(known ? *known : minimised(x, kGuess).x);
  if (fit_.sigmas_are_estimated && sigmas_.likelihood(released.point.z) < likelihood) return released;
  fit_.result.history.resize(rows);
  apart_.resize(rows);
  sigmas_.set(found);
  fit_.sigmas_are_estimated = true;
  return free;
}

// If residuals are linear in the parameters, their derivatives at one optimum tell the other one: no simulation is
// needed. They are linear if they explain those at the start, x. Returns the other optimum, empty if it is the same
// one.
std::optional<Eigen::VectorXd> FitSearch::released_if_linear(const LeastSquaresResult& free,
                                                             const std::vector<double>& first,
                                                             const Eigen::VectorXd& x) {
  const Eigen::VectorXd moved = x.cwiseMax(stack_.x_lower).cwiseMin(stack_.x_upper) - free.x;
  const Eigen::VectorXd change = residuals_at_start() - free.point.z;
  const bool is_linear = change.norm() > kFarApart * free.point.z.norm() &&
                         (change - free.point.z_x * moved).norm() <= kLinear * change.norm();
  if (!is_linear || stack_.equalities > 0) return std::nullopt;
  LinearStack linear(stack_, free);
  const std::vector<double> found = sigmas_.sigmas();
  sigmas_.set(first);
  LeastSquaresOptions solver = solver_options(fit_);
  const Eigen::VectorXd guess = solve_least_squares(linear, free.x, solver).x;
  linear.groups = sigmas_.scale_groups();
  const LeastSquaresResult released = solve_least_squares(linear, guess, solver);
  LeastSquaresPoint same = free.point;
  linear.evaluate(free.x, same);
  const bool is_better = released.cost_final < linear.cost(same.z) - kSameOptimum;
  sigmas_.set(found);
  return is_better ? released.x : Eigen::VectorXd();
}

LeastSquaresResult FitSearch::without_sigmas(const Eigen::VectorXd& x) {
  stack_.groups = sigmas_.scale_groups();
  LeastSquaresResult solution = minimised(x);
  stack_.groups.clear();
  fit_.sigmas_are_estimated =
      solution.status == SolverStatus::converged || solution.status == SolverStatus::no_progress;
  if (fit_.sigmas_are_estimated) take(solution);
  if (solution.point.z.size() > 0) solution.cost_final = stack_.cost(solution.point.z);
  return solution;
}

// The sigmas by the residuals of the solution, which are by these sigmas then. Returns the largest change.
double FitSearch::take(LeastSquaresResult& solution) {
  const Eigen::VectorXd before = stack_.sigma();
  const double change = sigmas_.take(solution.point.z);
  const Eigen::ArrayXd factor = before.cwiseQuotient(stack_.sigma()).array();
  solution.point.z.head(stack_.samples()).array() *= factor;
  solution.point.z_x.topRows(stack_.samples()).array().colwise() *= factor;
  solution.cost_final = stack_.cost(solution.point.z);
  return change;
}

LeastSquaresResult FitSearch::in_turn_with_sigmas(const Eigen::VectorXd& x) {
  LeastSquaresResult solution = minimised(x);
  for (int round = 0; solution.status == SolverStatus::converged; ++round) {
    const double change = take(solution);
    fit_.sigmas_are_estimated = change < kSigmaChange || round == kSigmaRounds;
    if (round == kSigmaRounds && change >= kSigmaChange)
      solution.message += fmt::format("; estimated sigmas still change by {:.1g} of themselves", change);
    if (fit_.sigmas_are_estimated) break;
    solution = minimised(solution.x);
  }
  return solution;
}

// Sigmas, the loss or the multipliers of equations change on the way.
bool FitSearch::cost_changes() const {
  return estimates_sigma(fit_.spec) || fit_.spec.loss.type == LossType::tukey || stack_.equalities > 0;
}

Eigen::VectorXd FitSearch::by_sigmas(Eigen::VectorXd apart) const {
  apart.head(stack_.samples()).array() /= stack_.sigma().array();
  return apart;
}

void FitSearch::measure_costs_by_the_end(double cost_final) {
  fit_.result.cost_final = cost_final;
  for (std::size_t k = 0; k < apart_.size(); ++k) fit_.result.history[k].cost = stack_.cost(by_sigmas(apart_[k]));
  if (!apart_.empty()) fit_.result.cost_initial = fit_.result.history.front().cost;
}

LeastSquaresResult FitSearch::solved() {
  return estimates_of(fit_.spec.loss, stack_, [this](const auto& loss, const auto& x) { return estimate(loss, x); });
}

LeastSquaresResult refit(const FitContext& fit, ExperimentStack& stack) {
  return estimates_of(fit.spec.loss, stack, [&](const Loss& loss, const Eigen::VectorXd& x) {
    stack.loss = loss;
    return solve_with_equalities(stack, x, solver_options(fit));
  });
}

}  // namespace mbsopt::inline optim
