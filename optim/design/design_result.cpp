#include "optim/design/design_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace mbsopt::inline optim {

std::string DesignConstraint::in_words() const {
  return load_case.empty() ? objective : fmt::format("{} ({})", objective, load_case);
}

void DesignResult::add_counts(const DesignResult& of) {
  iterations += of.iterations;
  evaluations += of.evaluations;
  failed_evaluations += of.failed_evaluations;
  simulations += of.simulations;
  wall_seconds += of.wall_seconds;
}

void DesignResult::follow(DesignResult earlier) {
  add_counts(earlier);
  objective_initial = earlier.objective_initial;
  for (std::size_t v = 0; v < variables.size(); ++v) variables[v].initial = earlier.variables[v].initial;
  for (std::size_t c = 0; c < constraints.size(); ++c) constraints[c].initial = earlier.constraints[c].initial;
  for (std::size_t c = 0; c < cases.size(); ++c) cases[c].initial = earlier.cases[c].initial;
  for (std::size_t k = 0; k < terms.size(); ++k) terms[k].initial = earlier.terms[k].initial;
  std::vector<DesignRow> rows = std::move(earlier.history);
  const int before = rows.empty() ? 0 : rows.back().iteration;
  for (DesignRow& row : history) {
    if (row.iteration == 0) continue;
    row.iteration += before;
    rows.push_back(std::move(row));
  }
  history = std::move(rows);
}

bool DesignResult::is_at_boundary() const {
  return std::ranges::any_of(variables, [](const DesignVariable& v) { return v.at_lower || v.at_upper; }) ||
         std::ranges::any_of(constraints, [](const DesignConstraint& c) { return c.at_lower || c.at_upper; });
}

}  // namespace mbsopt::inline optim
