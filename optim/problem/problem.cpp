#include "optim/problem/problem.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace mbsopt::inline optim {

std::vector<WeightedObjective> DesignSpec::terms() const {
  if (!maximize.empty()) return {{maximize, -1}};
  if (!sum.empty()) return sum;
  if (largest_of.empty()) return {{minimize}};
  std::vector<WeightedObjective> terms;
  for (const std::string& name : largest_of) terms.push_back({name});
  return terms;
}

std::string DesignSpec::name() const {
  if (!largest_of.empty()) return fmt::format("largest of {}", fmt::join(largest_of, ", "));
  if (sum.empty()) return maximize.empty() ? minimize : maximize;
  std::string words;
  for (const WeightedObjective& term : sum) {
    if (!words.empty()) words += term.weight < 0 ? " - " : " + ";
    const double factor = words.empty() ? term.weight : std::abs(term.weight);
    const bool is_simple = term.objective.find_first_of("+-*/^") == std::string::npos;
    const std::string name = is_simple ? term.objective : "(" + term.objective + ")";
    words += factor == 1 ? name : fmt::format("{:g} {}", factor, name);
  }
  return words;
}

bool DesignSpec::uses(const std::string& objective) const {
  const std::vector<WeightedObjective> all = terms();
  return std::ranges::count(all, objective, &WeightedObjective::objective) > 0 ||
         std::ranges::count(subject_to, objective, &ObjectiveBound::objective) > 0;
}

}  // namespace mbsopt::inline optim
