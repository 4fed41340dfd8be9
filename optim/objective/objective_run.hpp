// One run of several objectives: what their costs integrate to, turned into psi and its gradient; and the true extremes
// that smooth maxima and minima stand for.
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

namespace mbsopt {

class ObjectiveRun {
 public:
  using Sweep = std::function<SimulationResult(std::span<const Cost>)>;

  // progress: as in RunOptions, for the search of true extremes.
  ObjectiveRun(std::vector<const Objective*> objectives, const Mechanism& mechanism, const SimulationSettings& settings,
               std::function<bool(double t)> progress = {});

  // Calls the sweep with the objectives' costs, with x0 = 0; and once more with x0 = the extremes of that run where an
  // exponential of a smooth extreme left the range of numbers.
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

// The value that each objective stands for which is an extreme, on given steps: on the dense output at eight points of
// each step, and where the parabolas through three of them have tops beyond: a value that is reached. None where
// progress, called after steps as in RunOptions, stops the search.
std::vector<std::optional<double>> true_extremes(const std::vector<const Objective*>& objectives,
                                                 const Mechanism& mechanism, const SimulationSettings& settings,
                                                 const StepSequence& steps,
                                                 const std::function<bool(double t)>& progress = {});

}  // namespace mbsopt
