#include "optim/problem/bounded_means.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbsopt {

std::optional<std::size_t> bounded_mean(const ObjectiveBound& bound) {
  for (std::size_t k = 0; k < bound.means.size(); ++k)
    if (bound.means[k]) return k;
  return std::nullopt;
}

std::string name_of_mean(std::size_t kind, const Expression& of) {
  return fmt::format("{} {}", kMeanKinds[kind].name, of.text());
}

void name_bounded_means(Problem& problem) {
  if (!problem.design) return;
  for (ObjectiveBound& bound : problem.design->subject_to) {
    const std::optional<std::size_t> kind = bounded_mean(bound);
    if (!kind) continue;
    ObjectiveSpec objective;
    objective.name = bound.objective = name_of_mean(*kind, *bound.means[*kind]);
    objective.means[*kind] = bound.means[*kind];
    const double size = std::max(std::abs(bound.lower.value_or(0)), std::abs(bound.upper.value_or(0)));
    if (kMeanKinds[*kind].extreme != Extreme::none)
      objective.sharpness = bound.sharpness.value_or(ObjectiveBound::kSharpness / (size > 0 ? size : 1));
    bound.means = {}, bound.sharpness.reset();
    problem.objectives.push_back(std::move(objective));
  }
}

}  // namespace mbsopt
