// result.json: what a run found, for scripts. Keys as in docs/cli.md, always in the same order.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/integrate/simulation.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

using Json = nlohmann::ordered_json;

Json to_json(const ModelSummary& summary);
Json to_json(const SimulationStatistics& statistics);

// The parts a run has gathered, as text in the order of the contract.
std::string result_json_text(const Json& parts);

}  // namespace mbsopt
