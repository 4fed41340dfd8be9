#include "optim/problem/data_issues.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_path.hpp"
#include "core/scene/signals.hpp"
#include "optim/problem/logged_columns.hpp"

namespace mbsopt::inline optim {
namespace {

// A record farther from the start than this, in its own lengths, was not meant to be reached by a simulation. Its clock
// may count from 1970 or from midnight.
constexpr double kFar = 100;
constexpr double kLong = 1e6;       // s: no motion of a mechanism is recorded for eleven days, but clocks count in us
constexpr double kResolved = 1e-8;  // as simulation.end_time: a step of a millionth of the span still has two digits

class DataCheck {
 public:
  DataCheck(const ExperimentSpec& experiment, const std::string& place, const CsvTable& data, const Scene& scene)
      : experiment_(experiment),
        place_(place),
        data_(data),
        scene_(scene),
        start_(experiment.start_time.value_or(scene.simulation.start_time)) {}

  std::vector<SceneIssue> issues() {
    attempt(place_ + ".time", [&] { data_.column(experiment_.time); });
    for (std::size_t c = 0; c < experiment_.channels.size(); ++c) check_column(c);
    if (issues_.empty()) attempt(place_ + ".data", [&] { ascending_times(data_, experiment_.time); });
    if (issues_.empty()) check_samples();
    if (std::ranges::all_of(issues_, &SceneIssue::is_warning))
      for (std::size_t c = 0; c < experiment_.channels.size(); ++c)
        check_other_unit(c), check_numbers(c), check_values(c);
    return std::move(issues_);
  }

 private:
  void report(const std::string& path, std::string words, bool is_warning = false) {
    issues_.push_back({path, std::move(words), is_warning});
  }
  void warn(const std::string& path, std::string words) { report(path, std::move(words), true); }
  std::string channel_path(std::size_t c, const char* key) const {
    return child_path(place_ + ".channels", c) + "." + key;
  }

  void check_column(std::size_t c) {
    const std::string& column = experiment_.channels[c].column;
    attempt(channel_path(c, "column"), [&] { data_.column(column); });
    if (column == experiment_.time)
      report(channel_path(c, "column"), fmt::format("'{}' is the column of the times", column));
    check_unit(c);
    for (std::size_t k = 0; k < c; ++k)
      if (experiment_.channels[k].column == column)
        report(channel_path(c, "column"),
               fmt::format("'{}' is compared by channels[{}] already; its samples would count twice", column, k));
  }

  void check_unit(std::size_t c) {
    const ChannelSpec& channel = experiment_.channels[c];
    const auto sensor = std::ranges::find(scene_.sensors, channel.sensor, &Sensor::name);
    const TypeRow* const row = sensor == scene_.sensors.end() ? nullptr : find_row(kSensorQuantities, sensor->quantity);
    if (!row || !channel.gain.is_number() || !data_.has_column(channel.column)) return;
    const std::string text = stated_unit(channel, data_);
    const std::optional<Unit> unit = parse_column_unit(text);
    if (text.empty() || !unit || unit->dimension.is_none() || compatible(unit->dimension, row->dimension)) return;
    report(channel_path(c, "column"),
           fmt::format("'{}' is in {}, the sensor '{}' in {}", channel.column, to_string(unit->dimension),
                       channel.sensor, to_string(row->dimension)));
  }

  // The header says one unit, the problem another one of the same dimension.
  void check_other_unit(std::size_t c) {
    const ChannelSpec& channel = experiment_.channels[c];
    if (channel.unit.empty() || !data_.has_column(channel.column)) return;
    const std::string_view header = parts_of_header(data_.header[data_.find_column(channel.column)]).unit.value_or("");
    const std::optional<Unit> said = parse_column_unit(header), counts = parse_column_unit(channel.unit);
    if (!said || !counts || !compatible(said->dimension, counts->dimension) || said->to_si == counts->to_si) return;
    warn(channel_path(c, "unit"), fmt::format("the header of '{}' says {}, \"unit\" says {}, which counts",
                                              channel.column, header, channel.unit));
  }

  // Numbers are in SI, as the values of the column are once they are read. Beside a column in another unit, a number
  // may be meant in that one.
  void check_numbers(std::size_t c) {
    const ChannelSpec& channel = experiment_.channels[c];
    const std::string text = stated_unit(channel, data_);
    const std::optional<Unit> unit = parse_column_unit(text);
    if (text.empty() || !unit || unit->to_si == 1 || unit->dimension.is_none()) return;
    const std::string si = to_string(unit->dimension);
    const std::optional<Unit> of_fields = parse_unit(text);  // there g is the gram
    const bool same = of_fields && of_fields->to_si == unit->to_si && compatible(of_fields->dimension, unit->dimension);
    const auto check = [&](const char* key, const Field& field, double when_absent) {
      const bool has_unit = field.text().find('[') != std::string::npos;
      if (!field.is_number() || has_unit || field.number() == when_absent) return;
      const double x = field.number();
      warn(channel_path(c, key),
           fmt::format("is {0:g} {1}, which is {2:.3g} {3}: write \"{4}\" if {0:g} {3} is meant, else "
                       "\"{0:g} [{1}]\"",
                       x, si, x / unit->to_si, text,
                       same ? fmt::format("{:g} [{}]", x, text) : fmt::format("{:g} [{}]", x * unit->to_si, si)));
    };
    check("sigma", channel.sigma, ChannelSpec().sigma.number());
    check("bias", channel.bias, 0);
  }

  template <class F>
  void attempt(const std::string& path, F&& look) {
    try {
      look();
    } catch (const CsvError& error) {
      report(path, error.what());
    }
  }

  // The rows of the channel's samples within the experiment.
  std::vector<std::size_t> samples(const ChannelSpec& channel) const {
    const std::vector<double>& t = data_.column(experiment_.time);
    const std::vector<double>& measured = data_.column(channel.column);
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < t.size(); ++row)
      if (t[row] >= start_ && t[row] <= end_ && !std::isnan(measured[row])) rows.push_back(row);
    return rows;
  }

  void check_samples() {
    const std::vector<double>& t = data_.column(experiment_.time);
    std::size_t first = t.size(), last = 0;
    for (std::size_t c = 0; c < experiment_.channels.size(); ++c) {
      const std::vector<std::size_t> rows = samples(experiment_.channels[c]);
      if (rows.empty()) {
        report(channel_path(c, "column"), fmt::format("'{}' of {} has no sample {}: its cells are empty or NaN there",
                                                      experiment_.channels[c].column, data_.name, window()));
        continue;
      }
      first = std::min(first, rows.front());
      last = std::max(last, rows.back());
    }
    if (first == t.size() || !(t[last] > start_)) {
      const std::string span =
          t.empty() ? "it has no rows" : fmt::format("its times run from {} to {} s", t.front(), t.back());
      issues_ = {{place_ + ".data", fmt::format("{} has no sample {}; {}", data_.name, window(), span)}};
    } else if (issues_.empty()) {
      check_times(t[first], t[last], data_.place(first));
    }
  }

  void check_times(double first, double last, const std::string& place) {
    const double span = last - first;
    if (!experiment_.start_time && span > 0 && first - start_ > kFar * span)
      report(place_ + ".data",
             fmt::format(
                 "{}: the record begins {:.6g} s after the start of the simulation, at {} s, and "
                 "lasts {:.6g} s: all the time before would be simulated. Subtract the first time from the column '{}' "
                 "(\"time_zero\": \"first\" does), or say by \"start_time\" where the experiment begins",
                 place, first - start_, start_, span, experiment_.time));
    else if (last - start_ < kResolved * std::max(std::abs(start_), std::abs(last)))
      report(place_ + ".data",
             fmt::format("{}: times about {:.6g} s do not resolve the steps of a record "
                         "of {:.6g} s: subtract the first time from the column '{}' (\"time_zero\": \"first\" does)",
                         place, last, last - start_, experiment_.time));
    else if (span > kLong && experiment_.time_unit.empty() && !time_has_unit())
      warn(place_ + ".time",
           fmt::format("{}: the record lasts {:.6g} s, {:.3g} days: is '{}' in s? Give its unit in the "
                       "header or in \"time_unit\" (\"s\", \"ms\")",
                       place, span, span / 86400, experiment_.time));
  }

  bool time_has_unit() const {
    return parts_of_header(data_.header[data_.find_column(experiment_.time)]).unit.has_value();
  }

  std::string window() const {
    return fmt::format("after the start at {} s{}", start_,
                       std::isfinite(end_) ? fmt::format(" and until {} s", end_) : "");
  }

  void check_values(std::size_t c) {
    const std::vector<std::size_t> rows = samples(experiment_.channels[c]);
    const std::vector<double>& measured = data_.column(experiment_.channels[c].column);
    const auto [least, most] = std::ranges::minmax_element(rows, {}, [&](std::size_t row) { return measured[row]; });
    if (rows.size() > 2 && measured[*least] == measured[*most])
      warn(channel_path(c, "column"),
           fmt::format("'{}' of {} never changes: {} samples of {:g}", experiment_.channels[c].column, data_.name,
                       rows.size(), measured[*least]));
    if (!check_turns(c, rows)) check_size(c, std::abs(measured[*least]) > std::abs(measured[*most]) ? *least : *most);
  }

  // The sensor of a channel, if it is an angle in rad and the gain is a number. Else null.
  const Sensor* angle_sensor(const ChannelSpec& channel) const {
    const auto sensor = std::ranges::find(scene_.sensors, channel.sensor, &Sensor::name);
    const bool angle = sensor != scene_.sensors.end() && unit_of(scene_, *sensor) == "rad" && channel.gain.is_number();
    return angle ? &*sensor : nullptr;
  }

  // An angle of many turns without a given unit may be in degrees.
  void check_size(std::size_t c, std::size_t row) {
    constexpr double kMany = 100;  // rad: less than a third of a turn in degrees, 16 turns in radians
    const ChannelSpec& channel = experiment_.channels[c];
    if (!angle_sensor(channel) || channel.gain.number() != 1 || !stated_unit(channel, data_).empty()) return;
    const double angle = data_.column(channel.column)[row];
    if (!(std::abs(angle) > kMany)) return;
    warn(channel_path(c, "column"),
         fmt::format("{}: '{}' is {:.6g} rad, {:.3g} turns: is the column in degrees? Give its unit in "
                     "the header or in \"unit\" (\"deg\" or \"rad\")",
                     data_.place(row), channel.column, angle, std::abs(angle) / (2 * std::numbers::pi)));
  }

  // An unwrapped angle is right if its samples are dense: steps of less than half a turn.
  bool check_unwrapped(std::size_t c, const std::vector<std::size_t>& rows) {
    constexpr double kDoubtful = 0.4;  // of a turn
    const ChannelSpec& channel = experiment_.channels[c];
    const double turn = 2 * std::numbers::pi * (channel.gain.is_number() ? std::abs(channel.gain.number()) : 1);
    const std::vector<double>& measured = data_.column(channel.column);
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const double step = std::abs(measured[rows[i]] - measured[rows[i - 1]]) / turn;
      if (!(step > kDoubtful)) continue;
      warn(channel_path(c, "unwrap"),
           fmt::format("{}: '{}' still steps by {:.2g} of a turn: steps of half a turn and more cannot be "
                       "told from its jumps, so the unwrapped angle may be wrong from here on",
                       data_.place(rows[i]), channel.column, step));
      return true;
    }
    return false;
  }

  // A jump is about a turn, and larger than usual steps of the record. Returns whether there is one.
  bool check_turns(std::size_t c, const std::vector<std::size_t>& rows) {
    if (experiment_.channels[c].unwrap) return check_unwrapped(c, rows);
    const ChannelSpec& channel = experiment_.channels[c];
    const Sensor* const sensor = angle_sensor(channel);
    if (!sensor) return false;
    std::vector<double> measured;
    for (const std::size_t row : rows) measured.push_back(data_.column(channel.column)[row]);
    std::size_t wrap = first_wrap(measured, 2 * std::numbers::pi * std::abs(channel.gain.number()));
    const bool degrees = wrap == 0 && channel.gain.number() == 1 && (wrap = first_wrap(measured, 360)) > 0;
    if (wrap == 0) return false;
    warn(channel_path(c, "column"),
         fmt::format("{}: '{}' jumps from {:.6g} to {:.6g}, by about a turn{}; the sensor '{}' goes on counting. "
                     "Unwrap the column (\"unwrap\": true does)",
                     data_.place(rows[wrap]), channel.column, measured[wrap - 1], measured[wrap],
                     degrees ? " in degrees, where rad are expected" : "", sensor->name));
    return true;
  }

  const ExperimentSpec& experiment_;
  const std::string& place_;
  const CsvTable& data_;
  const Scene& scene_;
  const double start_, end_ = experiment_.end_time.value_or(std::numeric_limits<double>::infinity());
  std::vector<SceneIssue> issues_;
};

}  // namespace

std::vector<SceneIssue> find_data_issues(const ExperimentSpec& experiment, const std::string& place,
                                         const CsvTable& data, const Scene& scene) {
  return DataCheck(experiment, place, data, scene).issues();
}

}  // namespace mbsopt::inline optim
