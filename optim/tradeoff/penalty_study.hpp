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
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_measurement.hpp"

namespace mbsopt::inline optim {

struct PenaltyStudyRow {
  double alpha = 0;
  double model_error = 0, rounding_error = 0, augmented_error = 0;  // of accelerations; NaN: they cannot be computed
  std::size_t quasidefinite = 0, cholesky = 0;                      // rows of the table
  Eigen::VectorXd rounding;                                         // per quantity; NaN where that run failed
};

struct PenaltyStudy {
  Tradeoff table;                   // its first row: the constrained equations, with the same integrator
  FormulationSettings formulation;  // xi, omega, projection of all penalty runs
  IntegratorSettings integrator;
  std::vector<PenaltyStudyRow> rows;
};

// xi, omega and projection are the scene's if it has a penalty form, else MBSVT's: 1, 10 and none.
PenaltyStudy study_penalty(const Scene& scene, const std::vector<Objective>& objectives,
                           const std::vector<double>& alphas, const TradeoffOptions& options = {});

// "1e2:1e16" means all powers of ten in this range, "1e5,3e7" these two. Throws std::invalid_argument.
std::vector<double> alphas_of(const std::string& text);

}  // namespace mbsopt::inline optim
