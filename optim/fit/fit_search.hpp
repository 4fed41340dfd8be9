// The search of a fit: least squares by rounds of sigmas and losses, and the history of its costs.
//
//   FitSearch search(fit, stack);            // from the start of the stack
//   const LeastSquaresResult solution = search.solved();
//   search.measure_costs_by_the_end(solution.cost_final);
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_context.hpp"
#include "optim/fit/sigma_estimation.hpp"
#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

class FitSearch {
 public:
  FitSearch(FitContext& fit, ExperimentStack& stack) : fit_(fit), stack_(stack), sigmas_(stack, fit.spec) {}

  LeastSquaresResult solved();
  // Fills the costs of result.history, cost_initial and cost_final by the sigmas, the loss and the multipliers of the
  // end.
  void measure_costs_by_the_end(double cost_final);
  Eigen::VectorXd residuals_at_start() const { return by_sigmas(apart_.front()); }
  const SigmaEstimation& sigmas() const { return sigmas_; }

 private:
  LeastSquaresResult estimate(const Loss& loss, const Eigen::VectorXd& x);
  LeastSquaresResult without_sigmas(const Eigen::VectorXd& x);
  LeastSquaresResult best_without_sigmas(const Eigen::VectorXd& x);
  std::optional<Eigen::VectorXd> released_if_linear(const LeastSquaresResult& free, const std::vector<double>& first,
                                                    const Eigen::VectorXd& x);
  LeastSquaresResult in_turn_with_sigmas(const Eigen::VectorXd& x);
  LeastSquaresResult minimised(const Eigen::VectorXd& x, double loosest = 0);  // tolerance: at least it
  double take(LeastSquaresResult& solution);
  bool cost_changes() const;
  Eigen::VectorXd by_sigmas(Eigen::VectorXd apart) const;

  FitContext& fit_;
  ExperimentStack& stack_;
  SigmaEstimation sigmas_;
  // measured - model, then the residuals of the priors, for each row of the history. One row suffices if the cost does
  // not change on the way.
  std::vector<Eigen::VectorXd> apart_;
};

// The refit of what validates, whose iterations are not those of the result; sigmas stay as they are.
LeastSquaresResult refit(const FitContext& fit, ExperimentStack& stack);

}  // namespace mbsopt::inline optim
