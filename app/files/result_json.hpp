// result.json: the results of a run, for scripts. docs/cli.md lists the keys; they are always in the same order.
#pragma once

#include <optional>
#include <string>

#include "app/files/json_text.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt::inline app {

Json to_json(const ModelSummary& summary);
Json to_json(const SimulationStatistics& statistics);
Json to_json(const IntegratorSettings& settings);  // type, rtol, atol

Json or_null(const std::optional<double>& value);
double number_of(const Json& object, const std::string& key);  // NaN if it is none

// "lower", "upper" or "": the bound at which a value is.
const char* bound_hit(bool lower, bool upper);
// The same as JSON; null if the value is at no bound.
Json bound_json(bool lower, bool upper);

// The parts of a run's result, as text in the order of docs/cli.md.
std::string result_json_text(const Json& parts);

}  // namespace mbsopt::inline app
