// Says what the columns of an identification hold before the fit. Windows of one experiment are one record.
//
//   std::vector<ChannelData> channels = channel_data(problem, data);   // problem: cut into windows, data: of these
//   add_residuals(channels, problem, start);                           // start: start_of_fit, or a preflight
//   std::cout << channel_table(channels);
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "app/run/run.hpp"
#include "optim/fit/identification.hpp"
#include "optim/problem/csv_table.hpp"

namespace mbsopt::inline app {

struct ChannelData {
  std::string experiment, column, unit;
  bool validates = false;
  std::size_t samples = 0, missing = 0;  // of rows between the start and the end that no delay takes before the start
  double interval = 0, gap = 0;          // median and largest time between samples [s]
  double least = 0, most = 0;            // measured, in the unit
  double rms_scaled = std::numeric_limits<double>::quiet_NaN();  // of (measured - model)/sigma at the start, if known
};

std::vector<ChannelData> channel_data(const Problem& problem, const std::vector<CsvTable>& data);
void add_residuals(std::vector<ChannelData>& channels, const Problem& problem, const IdentificationResult& start);

std::string channel_table(const std::vector<ChannelData>& channels);
Json to_json(const std::vector<ChannelData>& channels);

// The SI unit of a column; kUnknownUnit if neither the file nor the sensor tells.
std::string unit_of_channel(const Scene& scene, const ChannelSpec& channel, const CsvTable& data);

// Adds the windows of experiments to the result, "windows", and prints them. cut: cut_into_windows.
void add_windows(Run& run, const Problem& cut);

}  // namespace mbsopt::inline app
