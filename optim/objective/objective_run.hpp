// Runs of several objectives: the integrals of their costs become psi and its gradient, with smooth extremes or true
// ones.
//
//   SimulationResult r = run_objectives(objectives, mechanism, settings, [&](std::span<const Cost> costs) {
//     return simulate_adjoint(mechanism, settings, costs);
//   });
//   r.psi, r.psi_rho      // of the objectives, without parameters_only
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/simulate/simulation.hpp"
#include "optim/objective/objective.hpp"
#include "optim/objective/peaks.hpp"

namespace mbsopt::inline optim {

// The integral of one part of an objective, or its extreme on the side of the part.
struct ObjectiveMean {
  const Objective* objective;
  Eigen::Index row;  // of the objective
  ObjectivePart part;
  double x0 = 0;
};

// Calls the sweep with the costs of the objectives that need a simulation, at x0 = 0. If an exponential of a smooth
// extreme left the range of numbers, it calls it once more with x0 = the extremes of that run. psi and psi_rho have a
// row per objective, 0 where nothing is simulated and, on request, of extremes. The sweep may add costs behind those
// that it gets. progress has the meaning of RunOptions, for searches beside the run.
SimulationResult run_objectives(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                const SimulationSettings& settings,
                                const std::function<SimulationResult(std::span<const Cost>)>& sweep,
                                const std::function<bool(double t)>& progress = {}, bool smooth_extremes = true);

// One of the functions of which an objective is the largest or least: a peak of its expression, or of a peak to peak
// value two of them.
struct ExtremePiece {
  Eigen::Index row = 0;  // of psi
  int side = 1;          // -1: of the least
  double value = 0;
  Eigen::VectorXd gradient;  // per variable; the instant does not move it, as it is stationary or at a kink (peaks.hpp)
  double t = 0;              // [s]; of two, a sum that tells pairs apart
};

// One evaluation with true extremes. A run finds the steps, the other objectives and the peaks (peaks.hpp). Derivatives
// are those of a sweep on the same steps, in which each peak is a sample at its instant, or at a kink two beside it.
//
//   ExtremeRun run(objectives, settings, options);
//   if (run.find(mechanism_without_derivatives)) run.differentiate(mechanism, false, variables);
//   run.result.psi, run.pieces
class ExtremeRun {
 public:
  // All arguments outlive the run.
  ExtremeRun(const std::vector<Objective>& objectives, const SimulationSettings& settings, const RunOptions& options);

  // Sets psi, steps and statistics. Returns false with a message if the run fails. Throws as Objective::instants_of().
  bool find(const Mechanism& mechanism);
  // Then psi_rho, objective x variable of these, and the pieces.
  bool differentiate(const Mechanism& mechanism, bool backward, const std::vector<int>& variables);

  SimulationResult result;
  std::vector<ExtremePiece> pieces;  // the most extreme ones of each objective first
  long simulations = 0;

 private:
  void set_extremes(const Eigen::VectorXd& values, const Eigen::MatrixXd& values_rho);

  const std::vector<Objective>& objectives_;
  const SimulationSettings& settings_;
  const RunOptions& options_;
  std::vector<ObjectiveMean> sides_;  // the largest or least values of expressions
  std::vector<std::vector<Peak>> peaks_;
};

// The true extreme of each objective that is one, on given steps (peaks.hpp). There is none if progress, called after
// steps as in RunOptions, stops the search.
std::vector<std::optional<double>> true_extremes(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                                 const SimulationSettings& settings, const StepSequence& steps,
                                                 const std::function<bool(double t)>& progress = {});

// Sentences on smooth extremes that leave out a peak which the true extreme shows. One of the exponent k that lasts the
// part e^-d of the run is lower by d/k.
std::vector<std::string> missed_peaks(const std::vector<Objective>& objectives, const Eigen::VectorXd& psi,
                                      const std::vector<std::optional<double>>& true_values);

}  // namespace mbsopt::inline optim
