// Values of objectives in results: a smooth maximum or minimum with the true one beside it.
#pragma once

#include <optional>
#include <string>

#include "app/files/result_json.hpp"

namespace mbsopt {

Json objective_json(double value, const std::optional<double>& true_value);
// "   (true extreme: 0.213)", or nothing.
std::string true_extreme_text(const std::optional<double>& true_value);

}  // namespace mbsopt
