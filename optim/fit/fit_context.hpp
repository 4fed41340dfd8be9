// The parts of an identification share the problem, its data, and the result as far as it is known.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_result.hpp"
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

}  // namespace mbsopt::inline optim
