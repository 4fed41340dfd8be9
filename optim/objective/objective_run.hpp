// One run of several objectives. It turns the integrals of their costs into psi and its gradient, and finds the true
// extremes of smooth maxima and minima.
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

namespace mbsopt::inline optim {

// Calls the sweep with the costs of the objectives that need a simulation, at x0 = 0. If an exponential of a smooth
// extreme left the range of numbers, it calls it once more with x0 = the extremes of that run. psi and psi_rho have a
// row per objective, 0 where nothing is simulated. progress has the meaning of RunOptions, for searches beside the run.
SimulationResult run_objectives(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                const SimulationSettings& settings,
                                const std::function<SimulationResult(std::span<const Cost>)>& sweep,
                                const std::function<bool(double t)>& progress = {});

// The true extreme of each objective that is one, on given steps. It evaluates the dense output at eight points of each
// step, at the times of the rows of a trajectory, and at higher tops of parabolas through three of them. If the motion
// is solved, it halves the brackets of these tops until rtol. So the motion reaches the value. There is none if
// progress, called after steps as in RunOptions, stops the search.
std::vector<std::optional<double>> true_extremes(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                                 const SimulationSettings& settings, const StepSequence& steps,
                                                 const std::function<bool(double t)>& progress = {});

// Sentences on smooth extremes that leave out a peak which the true extreme shows. One of the exponent k that lasts the
// part e^-d of the run is lower by d/k.
std::vector<std::string> missed_peaks(const std::vector<Objective>& objectives, const Eigen::VectorXd& psi,
                                      const std::vector<std::optional<double>>& true_values);

}  // namespace mbsopt::inline optim
