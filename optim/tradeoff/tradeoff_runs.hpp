// One problem at many settings: simulations and gradients. Each answer holds the quantities that the trade between
// speed and accuracy compares. Failures are messages, never exceptions.
//
//   const TradeoffRuns runs(problem.scene, objectives_of(problem));
//   const Answer answer = runs.motion(settings);                    // motion, sensors, psi
//   const Answer gradient = runs.gradients(settings, GradientMethod::adjoint);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "optim/machine/stopwatch.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/sampled_motion.hpp"

namespace mbsopt::inline optim {

struct Answer {
  bool ok = false;
  bool out_of_time = false;  // the limit ended it
  std::string message;       // why it is not ok
  SampledMotion motion;
  Eigen::VectorXd y_initial;
  Eigen::VectorXd psi;      // per objective
  Eigen::MatrixXd psi_rho;  // objective x parameter
  SimulationStatistics statistics;
  StepSequence steps;
  double wall_seconds = 0;  // compiling the mechanism, assembly and integration
};

struct RunLimit {
  double seconds = std::numeric_limits<double>::infinity();  // a run that takes longer is abandoned
  std::function<bool()> interrupted = {};
  Clock clock = {};                             // of the limit and of the times reported
  std::function<void(double t)> progress = {};  // after steps
};

class TradeoffRuns {
 public:
  static constexpr int kSamples = 100;

  TradeoffRuns(Scene scene, std::vector<Objective> objectives);

  // psi alone, as a simulation computes it. This is timed.
  Answer values(const SimulationSettings& settings, const RunLimit& limit = {}) const {
    return run(settings, limit, false);
  }
  // Adds the motion and the sensors at sample times.
  Answer motion(const SimulationSettings& settings, const RunLimit& limit = {}) const {
    return run(settings, limit, true);
  }
  // psi and psi_rho in all parameters. The limit applies to the forward part.
  Answer gradients(const SimulationSettings& settings, GradientMethod method, const RunLimit& limit = {}) const;

  const Scene& scene() const { return scene_; }
  const std::vector<Objective>& objectives() const { return objectives_; }
  const Mechanism& mechanism() const { return mechanism_; }  // without derivatives
  bool has_gradients() const;                                // objectives that are simulated, and parameters
  GradientMethod discrete_method() const;                    // the cheaper one, tlm or adjoint

 private:
  Answer run(const SimulationSettings& settings, const RunLimit& limit, bool sampled) const;

  Scene scene_;
  std::vector<Objective> objectives_;
  Mechanism mechanism_;
};

}  // namespace mbsopt::inline optim
