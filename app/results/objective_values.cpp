#include "app/results/objective_values.hpp"

#include <fmt/format.h>

#include "app/terminal/text_table.hpp"

namespace mbsopt {

Json objective_json(double value, const std::optional<double>& true_value) {
  Json json{{"value", value}};
  if (true_value) json["true_value"] = *true_value;
  return json;
}

std::string true_extreme_text(const std::optional<double>& true_value) {
  return true_value ? fmt::format("   (true extreme: {})", significant(*true_value, 10)) : std::string();
}

}  // namespace mbsopt
