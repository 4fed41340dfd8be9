// Identification: parameters that explain measured motions, by nonlinear least squares on exact derivatives.
//
//   measured_i = gain s(t_i - delay, rho) + bias + noise
//   z_i = (measured_i - gain s(t_i - delay, rho) - bias)/sigma
//   min 1/2 sum loss(z_i^2) + 1/2 sum_k ((rho_k - mean_k)/sigma_k)^2   within the bounds; the last sum is over priors
//
// Levenberg-Marquardt steps take the Jacobian of the tangent-linear model.
//
// gain, bias, delay and sigma are expressions over parameters. sigma must not depend on what is fitted, but the fit may
// estimate it from the residuals (sigma_estimation.hpp). Each experiment has a simulation of its own, from its
// start_time to its last sample, with its own values of the parameters that are `free` there. Experiments with role
// "validate" take no part. Their free parameters are refitted with the shared ones fixed, and their residuals are
// scored. Experiments with windows are cut first (windows.hpp).
//
//   const std::vector<CsvTable> data{read_csv("run1.csv")};      // one per experiment
//   const IdentificationResult result = run_identification(problem, data);
//   for (const FittedParameter& p : result.parameters) std::cout << p.name << ' ' << p.value << " +- " << p.std_error;
#pragma once

#include <vector>

#include "optim/fit/fit_result.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// problem.identification must be there; data: one table per experiment, in order. Throws std::invalid_argument where
// the problem and the data do not fit, CsvError where the data are wrong.
IdentificationResult run_identification(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options = {});

// The problem with the fitted values in place of those from which the fit starts.
Problem with_fitted_values(Problem problem, const IdentificationResult& fit);

// The start of a fit: how far it is from the data, and warnings of the derivatives there. Laws jump at instants which
// the unknowns move, or differences of residuals disagree with their derivatives (difference_comparison.hpp).
struct FitStart {
  // The residuals and the scores of the fitted experiments, but for those that could not be simulated.
  IdentificationResult residuals;
  std::vector<std::string> warnings;  // sentences; none if the start cannot be simulated, which the fit itself says
};

// problem: cut into windows; data: one table per experiment. simulation_progress is called from any thread; false
// abandons the comparison.
FitStart start_of_fit(const Problem& problem, const std::vector<CsvTable>& data,
                      const IdentificationOptions& options = {});

}  // namespace mbsopt::inline optim
