// Are the gradients right? Every method against every other, for every objective and parameter.
//
//   exact        tangent-linear model (TLM) and adjoint: the derivatives of the same numbers, agree to rounding
//   frozen       central differences, Richardson-extrapolated over a ladder of steps, on the accepted time steps of the
//                base run: the same function the exact methods differentiate
//   free         the same with step-size control at work: what a user of differences would get; judged within what
//                the integrator's error lets them say
//   identity     for random directions d and weights w: w'(psi_rho d) by TLM = (psi_rho' w)'d by adjoint
//   Taylor       |psi(rho + h d) - psi(rho) - h psi_rho d| falls as h^2 along a random d, on frozen steps
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

#include "optim/evaluator.hpp"
#include "optim/gradient_timing.hpp"
#include "optim/problem.hpp"

namespace mbsopt {

// How far methods may differ. docs/gradient-check.md says why these figures.
struct CheckThresholds {
  double tlm_adjoint = 1e-10;  // relative to the entry, or to rounding_floor times the gradient's size
  double frozen = 1e-7;        // relative to the entry, or within the differences' own error where that hides the entry
  double free = 1e-7;          // the same, or within own error and integration error (integration_error.hpp)
  double identity = 1e-10;     // relative to the sum of the terms' sizes
  double taylor_slope = 1.9;   // at least, 2 in theory
  // Entries below this part of the largest (each times its parameter's size) are compared to that part: they are
  // differences of numbers so much larger, and carry their rounding.
  double rounding_floor = 1e-3;
};

enum class Verdict {
  agrees,  // to the threshold
  buried,  // to the error of the differences themselves, which is larger than the threshold
  zero,    // exactly zero by every method
  failed,  // the differences could not be evaluated
  disagrees,
};
std::string_view to_string(Verdict verdict);  // "agrees", "within its error", "zero", "FAILED", "DISAGREES"
inline bool passes(Verdict verdict) { return verdict != Verdict::failed && verdict != Verdict::disagrees; }

struct CheckedEntry {
  std::string objective, parameter;
  double tlm = 0, adjoint = 0;
  double frozen = 0, frozen_error = 0;  // derivative and its estimated error; NaN, infinite where it failed
  double free = 0, free_error = 0;      // the error with that of the integration
  double tlm_adjoint = 0;               // relative difference
  double frozen_difference = 0;         // |frozen - tlm| relative to the entry
  double free_difference = 0;           // |free - tlm| relative to the entry
  Verdict exact = Verdict::disagrees;   // TLM against adjoint
  Verdict frozen_verdict = Verdict::disagrees;
  std::optional<Verdict> free_verdict;  // where free differences were asked for
};

struct TaylorRow {
  double h = 0, remainder = 0;
};
struct TaylorCheck {
  std::string objective;
  std::vector<TaylorRow> rows;  // h falling; empty where no step could be evaluated
  std::optional<double> slope;  // of the part above rounding; none where all of it is rounding: linear along d
  bool passed = false;
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
  MethodCost simulation, tlm_cost, adjoint_cost, frozen_cost, free_cost;  // differences: of all of them
  int timing_rounds = 0;
  SimulationStatistics statistics;  // of the base run
  long simulations = 0;
  bool passed() const;
};

struct GradientCheckOptions {
  CheckThresholds thresholds;
  double relative_step = 1e-2;  // the ladder's largest, of the parameter's size
  int rungs = 8;
  bool free_steps = true;
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

}  // namespace mbsopt
