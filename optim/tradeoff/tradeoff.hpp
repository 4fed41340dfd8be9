// The measured trade between speed and accuracy of one problem: a sweep of runs into one table (tradeoff_table.hpp).
// Errors are those against a reference that two methods certify (tradeoff_reference.hpp). Times are medians.
//
//   const Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), {.budget_seconds = 20});
//   for (const TradeoffRow& row : tradeoff.rows) std::cout << in_words(row.setting) << ' ' << row.wall_seconds << '\n';
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_table.hpp"

namespace mbsopt::inline optim {

struct TradeoffOptions {
  double budget_seconds = 60;  // 0: the reference, the scene's own settings and the defaults only
  std::function<bool()> interrupted = {};
  std::function<void(const std::string& doing, double done)> progress = {};  // done: 0..1
  Clock clock = {};                                                          // of the budget and of all times
};

// Integrators x tolerances (or steps) x formulations for the motion, the sensors and the objectives; every gradient
// method for their gradients. Curves go from loose to tight, the cheapest next point first. A curve ends if its next
// point would cost more than its share of the budget. It also ends if the reference is no more exact. Afterwards all
// points are timed again, in turn, so that a busy minute does not affect one of them alone.
Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options = {});

// The penalty form of the equations of motion at one alpha. The model's error falls as 1/alpha. The rounding of
// S = M + J' alpha J, which Cholesky factors, grows with alpha. The quasi-definite form of the same equations has no
// such rounding. docs/formulations.md.
struct PenaltyStudyRow {
  double alpha = 0;
  // These are the largest relative errors (of the largest entry) of accelerations at states of the right motion. They
  // are NaN if they cannot be computed. The last one is that of three refinements at this relative alpha.
  double model_error = 0;                       // penalty (quasi-definite) against the constrained equations
  double rounding_error = 0;                    // penalty by Cholesky against quasi-definite
  double augmented_error = 0;                   // augmented Lagrangian against the constrained equations
  std::size_t quasidefinite = 0, cholesky = 0;  // rows of the table
  // Per quantity what Cholesky adds on the very steps of the quasi-definite run; NaN where that run failed.
  Eigen::VectorXd rounding;
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
