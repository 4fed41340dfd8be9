// The report of an identification before the fit: the content of the columns and their distance from the start. With
// the given sigma it shows what the data would determine there.
//
//   const std::vector<ChannelData> channels = channel_data(start);    // start: of IdentificationOptions::preflight
//   print_preflight(std::cout, start, channels);
#pragma once

#include <ostream>

#include "app/files/result_json.hpp"
#include "optim/fit/identification.hpp"

namespace mbsopt {

void print_preflight(std::ostream& out, const IdentificationResult& start);
void add_preflight(Json& result, const IdentificationResult& start);  // preflight.parameters; identifiability

}  // namespace mbsopt
