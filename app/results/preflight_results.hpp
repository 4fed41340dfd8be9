// What `identify --preflight` says beside the table of channels: what the data would determine at the start, if sigma
// is as given.
#pragma once

#include <ostream>

#include "app/files/result_json.hpp"
#include "optim/fit/identification.hpp"

namespace mbsopt {

void print_preflight(std::ostream& out, const IdentificationResult& start);
void add_preflight(Json& result, const IdentificationResult& start);  // preflight.parameters; identifiability

}  // namespace mbsopt
