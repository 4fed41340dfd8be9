// Are the gradients right? The check compares every method with every other, for every objective and parameter.
//
//   exact        tangent-linear model (TLM) and adjoint: the derivatives of the same numbers, agree to rounding
//   frozen       central differences, Richardson-extrapolated over a ladder of steps, on the accepted time steps of the
//                base run: the same function the exact methods differentiate
//   free         the same with step-size control: the differences that a user would take; judged within the limits of
//                the integrator's error
//   identity     for random directions d and weights w: w'(psi_rho d) by TLM = (psi_rho' w)'d by adjoint
//   Taylor       |psi(rho + h d) - psi(rho) - h psi_rho d| falls as h^2 along a random d, on frozen steps
//   continuous   sensitivities of the differential equation by CVODES, at tolerances of its own (continuous_check.hpp)
//
// A scene whose integrator is CVODES has no discrete derivatives, and its steps cannot be frozen. Its forward and
// adjoint sensitivities replace TLM and adjoint and must agree to `continuous`. The check omits frozen, identity and
// Taylor.
//
//   const GradientCheck check = check_gradients(problem);
//   for (const CheckedEntry& e : check.entries) std::cout << e.parameter << ' ' << e.adjoint << ' ' << e.frozen;
//   return check.passed() ? 0 : 3;
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "optim/check/continuous_check.hpp"
#include "optim/check/gradient_differences.hpp"
#include "optim/check/gradient_timing.hpp"
#include "optim/check/taylor_remainders.hpp"
#include "optim/differences/verdict.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// The limits of the differences between methods. docs/gradient-check.md gives the reasons for these figures.
struct CheckThresholds {
  double tlm_adjoint = 1e-10;  // relative to the entry, or to rounding_floor times the gradient's size
  double frozen = 1e-7;        // relative to the entry, or within the differences' own error where that hides the entry
  double free = 1e-7;          // the same, or within own error and integration error (integration_error.hpp)
  double identity = 1e-10;     // relative to the sum of the terms' sizes
  double taylor_slope = 1.9;   // at least, 2 in theory
  // Entries below this part of the largest (each times its parameter's size) are compared to that part. They are
  // differences of numbers so much larger, with the rounding of these.
  double rounding_floor = 1e-3;
  // The limit for CVODES: relative to the entry or to rounding_floor's part, or within the integration errors.
  double continuous = 1e-6;
};

struct CheckedEntry {
  std::string objective, parameter;
  Eigen::Index row = 0, column = 0;  // of the gradients
  double tlm = 0, adjoint = 0;
  double frozen = 0, frozen_error = 0;         // derivative and its estimated error; NaN, infinite where it failed
  double free = 0, free_error = 0;             // the error with that of the integration
  double tlm_adjoint = 0;                      // relative difference
  double frozen_difference = 0;                // |frozen - tlm| relative to the entry
  double free_difference = 0;                  // |free - tlm| relative to the entry
  Verdict exact = Verdict::disagrees;          // TLM against adjoint
  std::optional<Verdict> frozen_verdict = {};  // set if steps can be frozen
  std::optional<Verdict> free_verdict = {};    // set if free differences were requested
  std::vector<LadderRung> rungs = {};          // h falling
};

struct IdentityCheck {
  Eigen::VectorXd d;  // direction in the parameters
  Eigen::VectorXd w;  // weights of the objectives
  double tlm = 0, adjoint = 0, relative_defect = 0;
  bool passed = false;
};

struct GradientCheck {
  bool ran = false;     // false: the base run failed
  std::string message;  // why
  std::vector<std::string> objectives, parameters;
  Eigen::VectorXd psi;
  Eigen::MatrixXd tlm, adjoint, frozen, free;  // objective x parameter
  std::vector<CheckedEntry> entries;           // objective by objective
  std::vector<TaylorCheck> taylor;
  std::vector<IdentityCheck> identities;
  bool discrete = true;                       // false: tlm and adjoint are sensitivities by CVODES
  std::optional<ContinuousCheck> continuous;  // set if requested
  GradientTiming timing;
  MethodCost frozen_cost, free_cost;     // of all differences
  SimulationStatistics statistics;       // of the base run
  std::vector<std::string> warnings;     // of the base run, and explanations of disagreement, in sentences
  std::vector<std::string> wrong_terms;  // of forces and costs written in C++ (user_terms.hpp), sentences
  long simulations = 0;
  bool passed() const;
};

struct GradientCheckOptions {
  CheckThresholds thresholds;
  double relative_step = 1e-2;  // the ladder's largest, of the parameter's size
  int rungs = 8;
  bool free_steps = true;
  bool continuous = true;        // compare with CVODES, too
  unsigned seed = 1;             // of the random directions
  GradientTimingOptions timing;  // rounds and seconds
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons the check
  std::function<void(int done, int of)> progress;     // parameters differenced
};

GradientCheck check_gradients(const Problem& problem, const GradientCheckOptions& options = {});
// The same for objectives that may be written in C++.
GradientCheck check_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                              const GradientCheckOptions& options = {});

}  // namespace mbsopt::inline optim
