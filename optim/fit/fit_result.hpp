// The options and the result of an identification: parameters, the fit of each channel, residuals, iterations.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/fit/residual_analysis.hpp"
#include "optim/fit/statistics.hpp"
#include "optim/problem/problem.hpp"
#include "optim/solver/least_squares.hpp"

namespace mbsopt::inline optim {

struct FittedParameter {
  std::string name;        // "k1", or "run1.theta0" where it is free in an experiment
  std::string parameter;   // in the scene
  std::string experiment;  // empty where shared
  std::string unit;
  double initial = 0, value = 0;
  std::optional<double> lower, upper;
  std::optional<Prior> prior;
  bool at_lower = false, at_upper = false;     // then its std_error, computed as if it were free, says little
  double std_error = FitStatistics::kUnknown;  // infinite where the data do not determine it
  double ci95[2] = {FitStatistics::kUnknown, FitStatistics::kUnknown};
};

struct ChannelFit {
  std::string column, sensor;
  std::string unit;                      // of rms and sigma, where the program of the fit has set it
  std::size_t samples = 0, missing = 0;  // used, and empty cells among its rows
  double rms = 0;                        // of measured - model
  double rms_scaled = 0;                 // of z
  double sigma = 1;
  bool sigma_is_estimated = false;                     // not yet where the fit was stopped before
  ResidualAnalysis analysis;                           // of z
  double within_prediction = FitStatistics::kUnknown;  // share of its samples within their prediction intervals
  std::size_t beyond_scale = 0;  // samples with |z| above the scale of the loss, which count for less than their square
};

struct ExperimentFit {
  std::string name;
  std::optional<WindowOrigin> window;  // where it is one
  bool validate = false;
  double start_time = 0, end_time = 0;  // of its simulation [s]
  std::size_t samples = 0;
  double rms = 0;  // of measured - model over all its channels: of one quantity only if these have one unit
  std::vector<ChannelFit> channels;
  std::vector<FittedParameter> refitted;  // validate: its free parameters
  std::string message;                    // validate: how the refit ended
};

// A row of residuals.csv.
struct ResidualRow {
  std::size_t experiment = 0, channel = 0;
  double t = 0, measured = 0, model = 0;
  double scaled = 0;                            // z
  std::size_t row = 0;                          // of the experiment's data
  double prediction = FitStatistics::kUnknown;  // half of the 95 % interval for a measurement there, about the model
};

// One iteration of the solver.
struct FitRow {
  int iteration = 0;
  // The fit minimises it. The result measures it by the loss and the sigmas of the end, progress by those so far.
  double cost = 0;
  double gradient_norm = 0;    // largest entry, of the scaled variables
  double step_norm = 0;        // of the scaled variables
  Eigen::VectorXd parameters;  // in the order of IdentificationResult::parameters
  long simulations = 0;        // so far
};

struct IdentificationResult {
  SolverStatus status = SolverStatus::failed;
  std::string message;  // in words, always
  std::vector<FittedParameter> parameters;
  FitStatistics statistics;  // in the order of parameters
  std::vector<ExperimentFit> experiments;
  std::vector<ResidualRow> residuals;  // by experiment, time, channel
  std::vector<FitRow> history;
  double cost_initial = 0, cost_final = 0;  // what is minimised, both by the loss and the sigmas of the end
  double aic = FitStatistics::kUnknown, bic = FitStatistics::kUnknown;  // of fits by the square
  std::vector<std::string> warnings;  // sentences, some after the path of what they are about
  std::size_t samples = 0;            // fitted
  int iterations = 0;
  long evaluations = 0, failed_evaluations = 0;  // points at which all experiments were simulated, with derivatives
  long simulations = 0;
  double wall_seconds = 0;
  bool ok() const { return status == SolverStatus::converged || status == SolverStatus::no_progress; }
};

// Options of an identification that the problem does not give.
struct IdentificationOptions {
  std::vector<std::shared_ptr<const UserForce>> user_forces;  // beside those of the scene; they see all parameters
  std::function<bool(const FitRow&)> progress;        // after every iteration; false stops, the best so far is kept
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons it
  // No step is taken: residuals at the start, and the standard errors that the given sigmas predict there.
  bool preflight = false;
  bool tests_angles = true;  // fits again where a column may be in degrees
  int threads = 1;           // experiments at a time; results do not depend on it
  bool remembers = false;    // the residuals of all points, so that none is simulated twice
};

}  // namespace mbsopt::inline optim
