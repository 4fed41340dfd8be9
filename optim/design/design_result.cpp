#include "optim/design/design_result.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace mbsopt::inline optim {

std::string DesignConstraint::in_words() const {
  return load_case.empty() ? objective : fmt::format("{} ({})", objective, load_case);
}

bool DesignResult::is_at_boundary() const {
  return std::ranges::any_of(variables, [](const DesignVariable& v) { return v.at_lower || v.at_upper; }) ||
         std::ranges::any_of(constraints, [](const DesignConstraint& c) { return c.at_lower || c.at_upper; });
}

}  // namespace mbsopt::inline optim
