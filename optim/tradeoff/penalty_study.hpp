// The effect of alpha on the penalty form of the equations of motion of one mechanism. The model's error falls as
// 1/alpha. The rounding of S = M + J' alpha J, which Cholesky factors, grows with alpha. The quasi-definite form of the
// same equations has no such rounding. docs/formulations.md.
//
// Accelerations: at states of the right motion, the largest relative error (of the largest entry).
//   model      penalty (quasi-definite) against the constrained equations
//   rounding   penalty by Cholesky against quasi-definite
//   augmented  augmented Lagrangian at this relative alpha, three refinements, against the constrained equations
//
// Runs: errors per quantity against the reference. Rounding is the part that Cholesky adds on the very steps of the
// quasi-definite run. The drift is the largest violation of the constraints.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt {

struct PenaltyRun {
  bool ok = false;
  std::string message;     // why not
  Eigen::VectorXd errors;  // per quantity
  SimulationStatistics statistics;
  double wall_seconds = 0;  // median
};

struct PenaltyStudyRow {
  double alpha = 0;
  double model_error = 0, rounding_error = 0, augmented_error = 0;  // of accelerations; NaN: they cannot be computed
  PenaltyRun quasidefinite, cholesky;
  Eigen::VectorXd rounding;  // per quantity; NaN where that run failed
};

struct PenaltyStudy {
  std::string message;  // why there is nothing
  TradeoffReference reference;
  FormulationSettings formulation;  // xi, omega, projection of all penalty runs
  std::string integrator;
  double rtol = 0, atol = 0;
  PenaltyRun constrained;  // with the same integrator
  std::vector<PenaltyStudyRow> rows;
  bool interrupted = false;
  double wall_seconds = 0;
  bool ok() const { return reference.ok(); }
};

struct PenaltyStudyOptions {
  std::vector<double> alphas;
  double rtol = 1e-9;
  double budget_seconds = 60;
  std::function<bool()> interrupted = {};
  std::function<void(const std::string& doing, double done)> progress = {};
  Clock clock = {};  // of the budget and of all times
};

// xi, omega and projection are the scene's if it has a penalty form, else MBSVT's: 1, 10 and none.
PenaltyStudy study_penalty(const Scene& scene, const std::vector<Objective>& objectives,
                           const PenaltyStudyOptions& options);

// "1e2:1e16" means all powers of ten in this range, "1e5,3e7" these two. Throws std::invalid_argument.
std::vector<double> alphas_of(const std::string& text);

}  // namespace mbsopt
