// The report of an identification before the fit: the content of the columns and their distance from the start. With
// the given sigma it shows what the data would determine there.
//
//   const std::vector<ChannelData> channels = channel_data(start);    // start: of IdentificationOptions::preflight
//   print_preflight(std::cout, start, channels);
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"
#include "optim/fit/identification.hpp"

namespace mbsopt {

struct ChannelData {
  std::string experiment, column;
  std::size_t samples = 0, missing = 0;
  double interval = 0, gap = 0;  // median and largest time between samples [s]
  double least = 0, most = 0;    // measured, in the column's unit
  double rms_scaled = 0;         // of (measured - model)/sigma at the start
};

std::vector<ChannelData> channel_data(const IdentificationResult& start);  // of the fitted experiments

void print_preflight(std::ostream& out, const IdentificationResult& start, const std::vector<ChannelData>& channels);
// preflight: channels, parameters; identifiability
void add_preflight(Json& result, const IdentificationResult& start, const std::vector<ChannelData>& channels);

}  // namespace mbsopt
