// Identification: parameters that explain measured motions, by nonlinear least squares on exact derivatives.
//
//   measured_i = gain s(t_i - delay, rho) + bias + noise        z_i = (measured_i - gain s(t_i - delay, rho) -
//   bias)/sigma min 1/2 sum loss(z_i^2) + 1/2 sum_k ((rho_k - mean_k)/sigma_k)^2   within the bounds, the last sum over
//   priors, by Levenberg-Marquardt on the Jacobian of the tangent-linear model
//
// gain, bias, delay and sigma are expressions over parameters; sigma must not depend on what is fitted, but may be
// estimated from the residuals (sigma_estimation.hpp). Each experiment has a
// simulation of its own, from its start_time to its last sample, with its own values of the parameters that are `free`
// there. Experiments with role "validate" take no part: with the shared parameters fixed, only their free ones are
// refitted, and the residuals are scored. Experiments with windows are cut first (windows.hpp).
//
//   const std::vector<CsvTable> data{read_csv("run1.csv")};      // one per experiment
//   const IdentificationResult result = run_identification(problem, data);
//   for (const FittedParameter& p : result.parameters) std::cout << p.name << ' ' << p.value << " +- " << p.std_error;
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "optim/fit/fit_result.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

struct UserForce;        // core/force/user_force.hpp
struct ResidualRecords;  // optim/fit/experiment_stack.hpp

struct IdentificationOptions {
  std::vector<std::string> profiles;  // names of fitted parameters whose profile likelihood is wanted
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  std::function<bool(const FitRow&)> progress;        // after every iteration; false stops, the best so far is kept
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons it
  // No step is taken: residuals at the start, and the standard errors that the given sigmas predict there.
  bool preflight = false;
  int threads = 1;                     // experiments at a time; results do not depend on it
  ResidualRecords* records = nullptr;  // of an earlier run that this one goes on with; of the fit and its profiles
  // After every point of a profile; false ends it there.
  std::function<bool(const std::string& name, double value, double tau)> profile_progress;
};

// problem.identification must be there; data: one table per experiment, in order. Throws std::invalid_argument where
// the problem and the data do not fit, CsvError where the data are wrong.
IdentificationResult run_identification(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options = {});

}  // namespace mbsopt
