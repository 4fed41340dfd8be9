#include "app/results/preflight_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/terminal/text_table.hpp"
#include "optim/machine/median.hpp"

namespace mbsopt {

std::vector<ChannelData> channel_data(const IdentificationResult& start) {
  std::vector<ChannelData> all;
  for (std::size_t e = 0; e < start.experiments.size(); ++e)
    for (std::size_t c = 0; c < start.experiments[e].channels.size(); ++c) {
      const ChannelFit& channel = start.experiments[e].channels[c];
      ChannelData data{start.experiments[e].name, channel.column, channel.samples, channel.missing, 0, 0, 0, 0,
                       channel.rms_scaled};
      std::vector<double> intervals;
      const ResidualRow* last = nullptr;
      for (const ResidualRow& row : start.residuals) {
        if (row.experiment != e || row.channel != c) continue;
        if (last) intervals.push_back(row.t - last->t);
        data.least = last ? std::min(data.least, row.measured) : row.measured;
        data.most = last ? std::max(data.most, row.measured) : row.measured;
        last = &row;
      }
      if (!intervals.empty())
        data.gap = *std::max_element(intervals.begin(), intervals.end()), data.interval = median(std::move(intervals));
      all.push_back(std::move(data));
    }
  return all;
}

void print_preflight(std::ostream& out, const IdentificationResult& start, const std::vector<ChannelData>& channels) {
  TextTable data({"experiment", "channel", "samples", "missing", "rate", "largest gap", "least", "most",
                  "rms/sigma at the start"});
  for (const ChannelData& c : channels)
    data.add({c.experiment, c.column, std::to_string(c.samples), std::to_string(c.missing),
              c.interval > 0 ? significant(1 / c.interval, 3) + " Hz" : "-", significant(c.gap, 3) + " s",
              significant(c.least, 4), significant(c.most, 4), significant(c.rms_scaled, 4)});
  TextTable parameters({"parameter", "start", "predicted std error", "unit"});
  for (const FittedParameter& p : start.parameters)
    parameters.add({p.name, significant(p.initial), std::isfinite(p.std_error) ? significant(p.std_error, 3) : "-",
                    p.unit.empty() ? "-" : p.unit});
  out << '\n' << data.text() << '\n' << parameters.text();
  for (const std::string& words : start.statistics.unidentifiable)
    out << "not determined by the data: " << words << '\n';
  out << "\npredicted at the start, with the sigmas as given; nothing was fitted\n";
}

void add_preflight(Json& result, const IdentificationResult& start, const std::vector<ChannelData>& channels) {
  for (const ChannelData& c : channels)
    result["preflight"]["channels"].push_back({{"experiment", c.experiment},
                                               {"column", c.column},
                                               {"samples", c.samples},
                                               {"missing", c.missing},
                                               {"interval", c.interval},
                                               {"largest_gap", c.gap},
                                               {"least", c.least},
                                               {"most", c.most},
                                               {"rms_scaled", c.rms_scaled}});
  for (const FittedParameter& p : start.parameters)
    result["preflight"]["parameters"][p.name] = {{"start", p.initial}, {"predicted_std_error", p.std_error}};
  result["identifiability"] = {{"condition_number", start.statistics.condition_number},
                               {"unidentifiable", start.statistics.unidentifiable}};
}

}  // namespace mbsopt
