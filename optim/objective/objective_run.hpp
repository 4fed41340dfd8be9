// One run of several objectives. It turns the integrals of their costs into psi and its gradient, and finds the true
// extremes of smooth maxima and minima.
//
//   ObjectiveRun objectives({&track, &peak}, mechanism, settings);
//   SimulationResult r = objectives.run([&](auto costs) { return simulate_adjoint(mechanism, settings, costs); });
//   r.psi, r.psi_rho      // of the objectives, without parameters_only
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/simulate/simulation.hpp"
#include "optim/objective/objective.hpp"

namespace mbsopt::inline optim {

class ObjectiveRun {
 public:
  using Sweep = std::function<SimulationResult(std::span<const Cost>)>;

  // progress has the meaning of RunOptions, for the search of true extremes.
  ObjectiveRun(std::vector<const Objective*> objectives, const Mechanism& mechanism, const SimulationSettings& settings,
               std::function<bool(double t)> progress = {});

  // Calls the sweep with the objectives' costs at x0 = 0. If an exponential of a smooth extreme left the range of
  // numbers, it calls it once more with x0 = the extremes of that run.
  SimulationResult run(const Sweep& sweep) const;

 private:
  struct Integral {
    Eigen::Index objective;
    ObjectivePart part;
    double x0 = 0;
  };
  SimulationResult integrated(const std::vector<Integral>& integrals, const Sweep& sweep) const;
  bool in_range(const std::vector<Integral>& integrals, const Eigen::VectorXd& values) const;
  const Objective& of(const Integral& integral) const {
    return *objectives_[static_cast<std::size_t>(integral.objective)];
  }

  std::vector<const Objective*> objectives_;
  const Mechanism mechanism_;
  SimulationSettings settings_;
  std::function<bool(double t)> progress_;
};

// The true extreme of each objective that is one, on given steps. It evaluates the dense output at eight points of each
// step, at the times of the rows of a trajectory, and at higher tops of parabolas through three of them. If the motion
// is solved, it halves the brackets of these tops until rtol. So the motion reaches the value. There is none if
// progress, called after steps as in RunOptions, stops the search.
std::vector<std::optional<double>> true_extremes(const std::vector<const Objective*>& objectives,
                                                 const Mechanism& mechanism, const SimulationSettings& settings,
                                                 const StepSequence& steps,
                                                 const std::function<bool(double t)>& progress = {});

// Sentences on smooth extremes that leave out a peak which the true extreme shows. One of the exponent k that lasts the
// part e^-d of the run is lower by d/k.
std::vector<std::string> missed_peaks(const std::vector<Objective>& objectives, const Eigen::VectorXd& psi,
                                      const std::vector<std::optional<double>>& true_values);

}  // namespace mbsopt::inline optim
