#include "core/run/run_arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
namespace {

constexpr double kRoundingOfTimes = 1e-12;  // of the times: of sums of sizes, and the gaps at events (event_times.hpp)

template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> text, Args&&... args) {
  throw std::invalid_argument(fmt::format(text, std::forward<Args>(args)...));
}

std::string of_objective(const Cost& cost) {
  return cost.name.empty() ? std::string("a cost") : "objective '" + cost.name + "'";
}

void check_bound(const Mechanism& mechanism, const Cost& cost, const PointCost& part, const char* which) {
  const Eigen::VectorXd* const rho = part.rho();
  if (!rho || (rho->size() == mechanism.rho().size() && *rho == mechanism.rho())) return;
  if (rho->size() != mechanism.rho().size())
    refuse("{}: its {} is bound to {} parameters, the mechanism has {}", of_objective(cost), which, rho->size(),
           mechanism.rho().size());
  Eigen::Index k = 0;
  while ((*rho)(k) == mechanism.rho()(k)) ++k;
  refuse("{}: its {} is bound to other parameters than the mechanism's (rho[{}] is {} there, {} here): bind it anew",
         of_objective(cost), which, k, (*rho)(k), mechanism.rho()(k));
}

void check_steps(const StepSequence& steps, double start, double end, double tie) {
  if (steps.times.size() != steps.sizes.size())
    refuse("frozen steps: {} times, but {} sizes", steps.times.size(), steps.sizes.size());
  if (steps.times.empty()) refuse("frozen steps: there are none");
  double t = start;
  for (std::size_t i = 0; i < steps.times.size(); ++i) {
    if (!(steps.sizes[i] > 0)) refuse("frozen steps: step {} has a size of {} s", i, steps.sizes[i]);
    if (!(std::abs(steps.times[i] - t) <= tie))
      refuse("frozen steps: step {} begins at {:.12g} s, not at {:.12g} s where {}", i, steps.times[i], t,
             i == 0 ? "the run does" : "the one before ends");
    t = steps.times[i] + steps.sizes[i];
  }
  if (steps.to_the_end && !(std::abs(t - end) <= tie))
    refuse("frozen steps: they end at {:.12g} s, the run at {:.12g} s: steps are missing, or of another run", t, end);
}

}  // namespace

void check_run_arguments(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                         std::span<const double> observed, const RunOptions& options) {
  const double start = settings.start_time, end = settings.end_time;
  if (!(end > start) || !std::isfinite(end - start))
    refuse("simulation: end_time is {} s, it has to be after start_time, {} s", end, start);
  const double tie = kRoundingOfTimes * std::max({end - start, std::abs(start), std::abs(end)});
  const auto within = [&](double t) { return t >= start - tie && t <= end + tie; };
  for (std::size_t i = 0; i < observed.size(); ++i)
    if (!within(observed[i]))
      refuse("sampling: times[{}] is {} s, outside the simulated time {} to {} s", i, observed[i], start, end);
  for (const Cost& cost : costs) {
    if (cost.running) check_bound(mechanism, cost, *cost.running, "running cost");
    if (cost.terminal) check_bound(mechanism, cost, *cost.terminal, "terminal cost");
    for (std::size_t i = 0; i < cost.samples.size(); ++i) {
      if (!cost.samples[i].cost) refuse("{}: samples[{}] has no cost (null)", of_objective(cost), i);
      if (!within(cost.samples[i].time))
        refuse("{}: samples[{}] is at {} s, outside the simulated time {} to {} s", of_objective(cost), i,
               cost.samples[i].time, start, end);
      check_bound(mechanism, cost, *cost.samples[i].cost, "sampled cost");
    }
  }
  if (options.frozen) check_steps(*options.frozen, start, end, tie);
}

}  // namespace mbsopt
