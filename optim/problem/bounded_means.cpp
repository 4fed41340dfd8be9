#include "optim/problem/bounded_means.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbsopt::inline optim {

std::vector<double> instants(const ObjectiveBound& bound, const SimulationSettings& simulation) {
  constexpr double kRounding = 1e-9;  // of the number of intervals
  const double intervals = (simulation.end_time - simulation.start_time) / *bound.every;
  std::vector<double> times;
  for (double k = 0; k <= intervals * (1 + kRounding); ++k)
    times.push_back(std::min(simulation.start_time + k * *bound.every, simulation.end_time));
  return times;
}

std::string name_of_mean(const Means& means) {
  const std::string_view kind = given_kind(means)->name;
  return fmt::format("{} {}", kind, mean_of(means, kind)->text());
}

namespace {

// Adds a limit and an objective per instant.
void name_sampled(Problem& problem) {
  std::vector<ObjectiveBound> bounds;
  for (ObjectiveBound& bound : problem.design->subject_to) {
    if (!bound.sampled) {
      bounds.push_back(std::move(bound));
      continue;
    }
    for (const double t : instants(bound, problem.scene.simulation)) {
      ObjectiveSpec objective;
      // 14 digits distinguish all instants and hide the rounding of k every.
      objective.name = fmt::format("{} at {:.14g} s", bound.sampled->text(), t);
      objective.samples = {{t, *bound.sampled}};
      bounds.push_back({objective.name, bound.lower, bound.upper});
      problem.objectives.push_back(std::move(objective));
    }
  }
  problem.design->subject_to = std::move(bounds);
}

}  // namespace

void name_bounded_means(Problem& problem) {
  if (!problem.design) return;
  name_sampled(problem);
  // Moves a mean into an objective of its own, unless another one has its name. Returns this objective if it is new.
  const auto named = [&](auto& user) -> ObjectiveSpec* {
    user.objective = name_of_mean(user.means);
    const Means means = std::exchange(user.means, {});
    if (std::ranges::count(problem.objectives, user.objective, &ObjectiveSpec::name) > 0) return nullptr;
    ObjectiveSpec& objective = problem.objectives.emplace_back();
    objective.name = user.objective;
    objective.means = means;
    return &objective;
  };
  for (WeightedObjective& term : problem.design->sum)
    if (given_kind(term.means)) named(term);
  for (ObjectiveBound& bound : problem.design->subject_to) {
    if (!given_kind(bound.means)) continue;
    ObjectiveSpec* const objective = named(bound);
    if (!objective) continue;  // of a sum that is minimised
    const double size = std::max(std::abs(bound.lower.value_or(0)), std::abs(bound.upper.value_or(0)));
    if (objective->is_extreme())
      objective->sharpness = bound.sharpness.value_or(ObjectiveBound::kSharpness / (size > 0 ? size : 1));
    bound.sharpness.reset();
  }
}

}  // namespace mbsopt::inline optim
