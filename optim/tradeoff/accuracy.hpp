// Integrator and tolerances for a wanted accuracy (simulation.accuracy), found by runs of the scene, with their
// expected error.
//
//   wanted   relative error of the objectives; of the motion if none is simulated (tradeoff_errors.hpp); of the sensors
//            for a fit, which sees the motion by them alone
//   method   explicit, unless stability and not accuracy limits its steps (core/watch/stiffness.hpp): then implicit
//   rtol     from error ~ C rtol^p, fitted to the runs so far, until the estimate is within the wanted error
//   error    the difference from a run with a tolerance 100 times smaller, by dopri853 if the method is explicit:
//            Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.4, where
//            y_hat - y1 estimates the error of a step; here of the whole run
//
//   AccuracyChoice choice = choose_accuracy(problem.scene, objectives_of(problem));
//   problem.scene.simulation = choice.settings;           // once: a design then has a function without jumps
//
// The choice does not depend on measured time: the same scene gives the same choice everywhere.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_errors.hpp"

namespace mbsopt::inline optim {

struct ErrorEstimate {
  std::string quantity;  // an objective's name, or "motion"
  bool relative = true;  // absolute where the quantity is near zero
  double error = 0;      // at least AccuracyChoice::kRounding
};

struct AccuracyChoice {
  // The distance of two runs by rounding alone. No estimate is smaller.
  static constexpr double kRounding = 1e-12;

  bool ok = false;
  std::string message;  // why not
  double wanted = 0;
  SimulationSettings settings;  // the scene's own, with integrator, rtol and atol chosen; without `accuracy`
  std::vector<ErrorEstimate> estimates;
  bool reached = false;      // all of them are within what is wanted
  double stiffest_rate = 0;  // |lambda| of steps at the edge of stability [1/s]; 0: there were none
  double limited_steps = 0;  // their part of the explicit run's
  std::string why;           // the method, in words
  IntegratorSettings verified_by;
  long simulations = 0;
  double largest_error() const;
};

struct AccuracyOptions {
  RunLimit limit = {};
  QuantityKind without_objectives = QuantityKind::motion;  // or sensors, where there are some
  std::function<void(int simulations)> progress = {};
};

// scene.simulation.accuracy must be set.
AccuracyChoice choose_accuracy(const Scene& scene, const std::vector<Objective>& objectives,
                               const AccuracyOptions& options = {});

// "engineering (1e-05)", "2e-04"
std::string accuracy_in_words(double accuracy);

}  // namespace mbsopt::inline optim
