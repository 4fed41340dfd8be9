#include "optim/check/gradient_timing.hpp"

#include "optim/machine/median.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {
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
  const Stopwatch stopwatch;
  const auto more = [&] {
    if (timing.rounds == 0) return true;
    const double seconds = stopwatch.seconds();
    if (timing.rounds >= options.most_rounds || seconds > options.most_seconds) return false;
    return timing.rounds < options.least_rounds || seconds < options.least_seconds;
  };
  constexpr GradientMethod kMethods[] = {GradientMethod::automatic, GradientMethod::adjoint, GradientMethod::tlm};
  std::vector<double> seconds[3], ratios[3];  // of each, and to the simulation of the same round
  for (; more(); ++timing.rounds) {
    for (std::size_t k = 0; k < 3; ++k) {
      seconds[k].push_back(timed(kMethods[k]));
      if (!timing.ok) return timing;
      const double one = seconds[0].back();
      ratios[k].push_back(one > 0 ? seconds[k].back() / one : 0);
    }
  }
  timing.simulation = {median(seconds[0]), median(ratios[0])};
  timing.adjoint = {median(seconds[1]), median(ratios[1])};
  timing.tlm = {median(seconds[2]), median(ratios[2])};
  return timing;
}

}  // namespace mbsopt::inline optim
