// result.json: what a run found, for scripts. Keys as in docs/cli.md, always in the same order.
#pragma once

#include <optional>
#include <string>

#include "app/files/json_text.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt {

Json to_json(const ModelSummary& summary);
Json to_json(const SimulationStatistics& statistics);

Json or_null(const std::optional<double>& value);

// "lower", "upper" or "": the bound that a value touches.
const char* bound_hit(bool lower, bool upper);
// The same as JSON: null where it touches none.
Json bound_json(bool lower, bool upper);

// The parts a run has gathered, as text in the order of the contract.
std::string result_json_text(const Json& parts);

}  // namespace mbsopt
