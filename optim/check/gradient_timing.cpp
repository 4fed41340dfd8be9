#include "optim/check/gradient_timing.hpp"

#include "optim/machine/median.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {
namespace {

// Seconds of one method, and their ratios to the simulations of the same rounds.
struct Rounds {
  std::vector<double> seconds, ratios;

  void add(double of_this, double of_simulation) {
    seconds.push_back(of_this);
    ratios.push_back(of_simulation > 0 ? of_this / of_simulation : 0);
  }
  MethodCost cost() const { return {median(seconds), median(ratios)}; }
};

}  // namespace

GradientTiming time_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                              const GradientTimingOptions& options) {
  GradientTiming timing;
  const Eigen::VectorXd rho = parameter_values(scene);
  // A new evaluator has no stored point to return.
  const auto timed = [&](GradientMethod method) {
    const bool derivatives = method != GradientMethod::automatic;
    Evaluator evaluator(scene, objectives, {}, {method, {}, options.user_forces, options.progress, derivatives});
    const Evaluation& e = derivatives ? evaluator.gradients(rho) : evaluator.values(rho);
    timing.simulations += e.simulations;
    timing.ok = e.ok;
    if (!e.ok) timing.message = e.message;
    if (!derivatives) {
      timing.steps = e.statistics.steps;
      timing.rhs_evaluations = e.statistics.rhs_evaluations;
    }
    return e.wall_seconds;
  };
  Rounds simulation, tlm, adjoint;
  const Stopwatch stopwatch;
  const auto more = [&] {
    if (timing.rounds == 0) return true;
    const double seconds = stopwatch.seconds();
    if (timing.rounds >= options.most_rounds || seconds > options.most_seconds) return false;
    return timing.rounds < options.least_rounds || seconds < options.least_seconds;
  };
  for (; more(); ++timing.rounds) {
    const double one = timed(GradientMethod::automatic);
    simulation.add(one, one);
    if (timing.ok) adjoint.add(timed(GradientMethod::adjoint), one);
    if (timing.ok) tlm.add(timed(GradientMethod::tlm), one);
    if (!timing.ok) return timing;
  }
  timing.simulation = simulation.cost();
  timing.adjoint = adjoint.cost();
  timing.tlm = tlm.cost();
  return timing;
}

}  // namespace mbsopt::inline optim
