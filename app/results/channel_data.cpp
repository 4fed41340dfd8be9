#include "app/results/channel_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/results/objective_units.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"
#include "optim/fit/experiment.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/machine/median.hpp"
#include "optim/problem/logged_columns.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline app {
namespace {

// A channel of all windows of its experiment, in the order of time.
struct RecordedChannel {
  ChannelData data;
  std::vector<double> times, measured;
};

void measure(RecordedChannel& column) {
  ChannelData& d = column.data;
  d.samples = column.times.size();
  if (d.samples == 0) return;
  const auto [least, most] = std::ranges::minmax(column.measured);
  d.least = least;
  d.most = most;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < column.times.size(); ++i) intervals.push_back(column.times[i] - column.times[i - 1]);
  if (intervals.empty()) return;
  d.gap = std::ranges::max(intervals);
  d.interval = median(std::move(intervals));
}

}  // namespace

std::string unit_of_channel(const Scene& scene, const ChannelSpec& channel, const CsvTable& data) {
  const std::string stated = stated_unit(channel, data);
  if (const auto unit = stated.empty() ? std::nullopt : parse_column_unit(stated))
    return unit->dimension.is_none() ? "1" : to_string(unit->dimension);
  const auto sensor = std::ranges::find(scene.sensors, channel.sensor, &Sensor::name);
  const bool same_unit = channel.gain.is_number() && channel.gain.number() == 1;
  const std::string unit = sensor == scene.sensors.end() || !same_unit ? "" : unit_in(scene, *sensor);
  return unit.empty() ? kUnknownUnit : unit;
}

std::vector<ChannelData> channel_data(const Problem& problem, const std::vector<CsvTable>& data) {
  const IdentificationSpec& spec = *problem.identification;
  const std::vector<UnknownParameter> of_fit = unknowns_of_fit(problem.scene, spec);
  const RecordChannels record = record_channels(spec);
  std::vector<RecordedChannel> columns;
  for (const auto& [e, c] : record.all) {
    const ExperimentSpec& experiment = spec.experiments[e];
    columns.push_back({{.experiment = record_name(experiment),
                        .column = experiment.channels[c].column,
                        .unit = unit_of_channel(problem.scene, experiment.channels[c], data[e]),
                        .validates = experiment.validate},
                       {},
                       {}});
  }
  for (std::size_t e = 0; e < spec.experiments.size(); ++e) {
    const ExperimentSpec& experiment = spec.experiments[e];
    const auto& unknowns = experiment.validate ? free_in(problem.scene, spec, e) : of_fit;
    const Experiment model(problem.scene, experiment, place_of(spec, e), data[e], parameter_values(problem.scene),
                           unknowns_in(problem.scene, spec, e, unknowns));  // whose bounds say how far a delay reaches
    const std::size_t first = record.first[e];
    for (std::size_t c = 0; c < model.channels(); ++c) columns[first + c].data.missing += model.missing(c);
    for (const Experiment::Sample& sample : model.samples()) {
      columns[first + sample.channel].times.push_back(model.times()[sample.time]);
      columns[first + sample.channel].measured.push_back(sample.measured);
    }
  }
  std::vector<ChannelData> channels;
  for (RecordedChannel& column : columns) {
    measure(column);
    channels.push_back(std::move(column.data));
  }
  return channels;
}

void add_residuals(std::vector<ChannelData>& channels, const Problem& problem, const IdentificationResult& start) {
  const std::vector<std::size_t> first = record_channels(*problem.identification).first;
  std::vector<double> squares(channels.size()), samples(channels.size());
  for (const ResidualRow& row : start.residuals) {
    const std::size_t k = first[row.experiment] + row.channel;
    squares[k] += row.scaled * row.scaled;
    ++samples[k];
  }
  for (std::size_t k = 0; k < channels.size(); ++k)
    if (samples[k] > 0) channels[k].rms_scaled = std::sqrt(squares[k] / samples[k]);
}

Json to_json(const std::vector<ChannelData>& channels) {
  Json all = Json::array();
  for (const ChannelData& c : channels)
    all.push_back({{"experiment", c.experiment},
                   {"column", c.column},
                   {"unit", c.unit},
                   {"role", c.validates ? "validate" : "fit"},
                   {"samples", c.samples},
                   {"missing", c.missing},
                   {"interval", c.interval},
                   {"largest_gap", c.gap},
                   {"least", c.least},
                   {"most", c.most},
                   {"rms_scaled", c.rms_scaled}});
  return all;
}

std::string channel_table(const std::vector<ChannelData>& channels) {
  Json rows = to_json(channels);
  for (Json& row : rows) {
    const double interval = number_of(row, "interval");
    row["rate"] = interval > 0 ? significant(1 / interval, 3) + " Hz" : "-";
    row["gap"] = cell(row["largest_gap"], 3) + " s";
    if (std::isnan(number_of(row, "rms_scaled"))) row.erase("rms_scaled");
  }
  return table_of(rows, {{"experiment", "experiment"},
                         {"channel", "column"},
                         {"samples", "samples"},
                         {"missing", "missing"},
                         {"rate", "rate"},
                         {"largest gap", "gap"},
                         {"least", "least", 4},
                         {"most", "most", 4},
                         {"unit", "unit"},
                         {"rms/sigma at the start", "rms_scaled", 4, true}})
      .text();
}

void add_windows(Run& run, const Problem& cut) {
  for (const ExperimentSpec& e : cut.identification->experiments) {
    if (!e.origin) continue;
    Json& windows = run.result["windows"][e.origin->experiment];
    if (windows.is_null()) windows = {{"start_time", *e.start_time}};
    windows["count"] = e.origin->number;
    windows["end_time"] = *e.end_time;
  }
  if (!run.result.contains("windows")) return;
  for (const auto& [name, windows] : run.result["windows"].items())
    run.context.out << fmt::format("{}: {} from {:g} to {:g} s\n", name,
                                   counted(windows["count"].get<std::size_t>(), "window"),
                                   windows["start_time"].get<double>(), windows["end_time"].get<double>());
}

}  // namespace mbsopt::inline app
