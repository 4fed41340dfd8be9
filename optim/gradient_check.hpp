// Are the gradients right? Every method against every other, for every objective and parameter.
//
//   exact        tangent-linear model (TLM) and adjoint: the derivatives of the same numbers, agree to rounding
//   frozen       central differences, Richardson-extrapolated over a ladder of steps, on the accepted time steps of the
//                base run: the same function the exact methods differentiate
//   free         the same with step-size control at work: what a user of differences would get; shown, not judged
//   identity     for random directions d and weights w: w'(psi_rho d) by TLM = (psi_rho' w)'d by adjoint
//   Taylor       |psi(rho + h d) - psi(rho) - h psi_rho d| falls as h^2 along a random d, on frozen steps
//
//   const GradientCheck check = check_gradients(problem);
//   for (const CheckedEntry& e : check.entries) std::cout << e.parameter << ' ' << e.adjoint << ' ' << e.frozen <<
//   '\n'; return check.passed() ? 0 : 3;
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "optim/evaluator.hpp"
#include "optim/problem.hpp"

namespace mbsopt {

// How far methods may differ. docs/gradient-check.md says why these figures.
struct CheckThresholds {
  double tlm_adjoint = 1e-10;  // relative to the entry, or to rounding_floor times the gradient's size
  double frozen = 1e-7;        // relative to the entry, or within the differences' own error where that hides the entry
  double identity = 1e-10;     // relative to the sum of the terms' sizes
  double taylor_slope = 1.9;   // at least, 2 in theory
  // Entries below this part of the largest (each times its parameter's size) are compared to that part: they are
  // differences of numbers so much larger, and carry their rounding.
  double rounding_floor = 1e-6;
};

enum class Verdict {
  agrees,  // to the threshold
  buried,  // the entry is smaller than the differences' rounding error, and agrees with them within it
  zero,    // exactly zero by every method
  disagrees,
};
std::string_view to_string(Verdict verdict);  // "agrees", "agrees within rounding", "zero", "DISAGREES"

struct CheckedEntry {
  std::string objective, parameter;
  double tlm = 0, adjoint = 0;
  double frozen = 0, frozen_error = 0;  // derivative and its estimated error
  double free = 0, free_error = 0;
  double tlm_adjoint = 0;              // relative difference
  double frozen_difference = 0;        // |frozen - tlm| relative to the entry
  double free_difference = 0;          // |free - tlm| relative to the entry
  Verdict exact = Verdict::disagrees;  // TLM against adjoint
  Verdict frozen_verdict = Verdict::disagrees;
};

struct TaylorRow {
  double h = 0, remainder = 0;
};
struct TaylorCheck {
  std::string objective;
  std::vector<TaylorRow> rows;  // h falling
  double slope = 0;             // of the part above rounding; infinite where the objective is linear along d
  bool passed = false;
};

struct IdentityCheck {
  double tlm = 0, adjoint = 0, relative_defect = 0;
  bool passed = false;
};

struct MethodCost {
  double wall_seconds = 0;  // median of some runs
  double ratio = 0;         // to one simulation
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
  SimulationStatistics statistics;                                        // of the base run
  long simulations = 0;
  bool passed() const;
};

struct GradientCheckOptions {
  CheckThresholds thresholds;
  double relative_step = 1e-2;  // the ladder's largest, of the parameter's size
  int rungs = 8;
  bool free_steps = true;
  int repetitions = 5;  // of the timings
  unsigned seed = 1;    // of the random directions
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons the check
  std::function<void(int done, int of)> progress;     // parameters differenced
};

GradientCheck check_gradients(const Problem& problem, const GradientCheckOptions& options = {});
// The same for objectives that may be written in C++.
GradientCheck check_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                              const GradientCheckOptions& options = {});

}  // namespace mbsopt
