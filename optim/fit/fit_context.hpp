// The parts of an identification share the problem, its data, and the result as far as it is known. They assess a
// solution: scores, statistics, intervals of prediction, criteria of likelihood.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_result.hpp"
#include "optim/fit/statistics.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"
#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

struct FitContext {
  const Scene& scene;
  const IdentificationSpec& spec;
  const std::vector<CsvTable>& data;  // one table per experiment
  const IdentificationOptions& options;
  std::function<bool(double t)> go_on = {};  // within a simulation, in any thread
  IdentificationResult result = {};
  bool abandoned = false, sigmas_are_estimated = false;
  Eigen::VectorXd shared = {};  // all parameters, the shared ones as fitted
};

LeastSquaresOptions solver_options(const FitContext& fit);

// Experiments with these unknowns; rho: the values of all other parameters.
ExperimentStack stack_of(const FitContext& fit, const std::vector<std::size_t>& experiments, const Eigen::VectorXd& rho,
                         std::vector<UnknownParameter> unknowns);
// All that are fitted, as given.
ExperimentStack fitted_stack(const FitContext& fit);

// Sets the names of all experiments in the result, also of those that cannot be scored.
void name_experiments(FitContext& fit);
// Scores an experiment by its residuals z channel by channel, and appends its rows of residuals to the result.
void score_experiment(FitContext& fit, const ExperimentStack::Member& member, const Eigen::VectorXd& z);
// The same of all experiments of the stack.
void score_all(FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& z);

// Statistics of the parameters by the samples and the priors at a solution. The experiments of the stack must be
// scored.
FitStatistics statistics_at(const FitContext& fit, const LeastSquaresResult& solution, const ExperimentStack& stack);

// The unknowns of the stack at x.
std::vector<FittedParameter> described(const FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& x,
                                       const FitStatistics& statistics);

// Sets the half-widths of the 95 % intervals for one more measurement: Seber and Wild, "Nonlinear Regression" (1989),
// section 5.1.1. The rows of residuals of these samples begin at `first`:
//   t sigma sqrt(v + variance),   variance = j covariance j' of the model's value, j = dz/drho
void predict(FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& variances, std::size_t first);

// sigmas: how many were estimated.
void compare_by_likelihood(FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& z, std::size_t sigmas);

}  // namespace mbsopt::inline optim
