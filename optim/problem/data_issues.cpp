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
        start_(experiment.start_time.value_or(scene.simulation.start_time)) {
    for (std::size_t c = 0; c < experiment.channels.size(); ++c) {
      const ChannelSpec& channel = experiment.channels[c];
      const auto sensor = std::ranges::find(scene.sensors, channel.sensor, &Sensor::name);
      const std::string unit = stated_unit(channel, data);
      channels_.push_back({channel, child_path(place + ".channels", c), unit,
                           unit.empty() ? std::nullopt : parse_column_unit(unit),
                           sensor == scene.sensors.end() ? nullptr : &*sensor});
    }
  }

  std::vector<SceneIssue> issues() {
    attempt(place_ + ".time", [&] { data_.column(experiment_.time); });
    for (const Channel& c : channels_) check_column(c);
    if (issues_.empty()) attempt(place_ + ".data", [&] { ascending_times(data_, experiment_.time); });
    if (issues_.empty()) check_samples();
    if (std::ranges::all_of(issues_, &SceneIssue::is_warning))
      for (const Channel& c : channels_) check_other_unit(c), check_numbers(c), check_values(c);
    return std::move(issues_);
  }

 private:
  struct Channel {
    const ChannelSpec& spec;
    std::string place;
    std::string unit_text;  // as the problem or the file states it; empty: neither does
    std::optional<Unit> unit;
    const Sensor* sensor;  // null: unknown
    double turn() const {  // of an angle, in the column
      return 2 * std::numbers::pi * (spec.gain.is_number() ? std::abs(spec.gain.number()) : 1);
    }
  };

  void report(const std::string& path, std::string words, bool is_warning = false) {
    issues_.push_back({path, std::move(words), is_warning});
  }
  void warn(const std::string& path, std::string words) { report(path, std::move(words), true); }

  void check_column(const Channel& c) {
    const std::string &column = c.spec.column, path = c.place + ".column";
    attempt(path, [&] { data_.column(column); });
    if (column == experiment_.time) report(path, fmt::format("'{}' is the column of the times", column));
    check_unit(c);
    for (std::size_t k = 0; &experiment_.channels[k] != &c.spec; ++k)
      if (experiment_.channels[k].column == column)
        report(path, fmt::format("'{}' is compared by channels[{}] already; its samples would count twice", column, k));
  }

  void check_unit(const Channel& c) {
    const TypeRow* const row = c.sensor ? find_row(kSensorQuantities, c.sensor->quantity) : nullptr;
    if (!row || !c.spec.gain.is_number() || !data_.has_column(c.spec.column)) return;
    if (!c.unit || c.unit->dimension.is_none() || compatible(c.unit->dimension, row->dimension)) return;
    report(c.place + ".column", fmt::format("'{}' is in {}, the sensor '{}' in {}", c.spec.column,
                                            to_string(c.unit->dimension), c.spec.sensor, to_string(row->dimension)));
  }

  // The header says one unit, the problem another one of the same dimension.
  void check_other_unit(const Channel& c) {
    if (c.spec.unit.empty() || !data_.has_column(c.spec.column)) return;
    const std::string_view header = parts_of_header(data_.header[data_.find_column(c.spec.column)]).unit.value_or("");
    const std::optional<Unit> said = parse_column_unit(header);
    if (!said || !c.unit || !compatible(said->dimension, c.unit->dimension) || said->to_si == c.unit->to_si) return;
    warn(c.place + ".unit",
         fmt::format("the header of '{}' says {}, \"unit\" says {}, which counts", c.spec.column, header, c.spec.unit));
  }

  // Numbers are in SI, as the values of the column are once they are read. Beside a column in another unit, a number
  // may be meant in that one.
  void check_numbers(const Channel& c) {
    if (!c.unit || c.unit->to_si == 1 || c.unit->dimension.is_none()) return;
    const std::string si = to_string(c.unit->dimension);
    const std::optional<Unit> of_fields = parse_unit(c.unit_text);  // there g is the gram
    const bool same =
        of_fields && of_fields->to_si == c.unit->to_si && compatible(of_fields->dimension, c.unit->dimension);
    const auto check = [&](const char* key, const Field& field, double when_absent) {
      const bool has_unit = field.text().find('[') != std::string::npos;
      if (!field.is_number() || has_unit || field.number() == when_absent) return;
      const double x = field.number();
      warn(c.place + key, fmt::format("is {0:g} {1}, which is {2:.3g} {3}: write \"{4}\" if {0:g} {3} is meant, else "
                                      "\"{0:g} [{1}]\"",
                                      x, si, x / c.unit->to_si, c.unit_text,
                                      same ? fmt::format("{:g} [{}]", x, c.unit_text)
                                           : fmt::format("{:g} [{}]", x * c.unit->to_si, si)));
    };
    check(".sigma", c.spec.sigma, ChannelSpec().sigma.number());
    check(".bias", c.spec.bias, 0);
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
    for (const Channel& c : channels_) {
      const std::vector<std::size_t> rows = samples(c.spec);
      if (rows.empty()) {
        report(c.place + ".column", fmt::format("'{}' of {} has no sample {}: its cells are empty or NaN there",
                                                c.spec.column, data_.name, window()));
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

  void check_values(const Channel& c) {
    const std::vector<std::size_t> rows = samples(c.spec);
    const std::vector<double>& measured = data_.column(c.spec.column);
    const auto [least, most] = std::ranges::minmax_element(rows, {}, [&](std::size_t row) { return measured[row]; });
    if (rows.size() > 2 && measured[*least] == measured[*most])
      warn(c.place + ".column", fmt::format("'{}' of {} never changes: {} samples of {:g}", c.spec.column, data_.name,
                                            rows.size(), measured[*least]));
    if (!check_turns(c, rows)) check_size(c, std::abs(measured[*least]) > std::abs(measured[*most]) ? *least : *most);
  }

  bool is_angle(const Channel& c) const {  // in rad, and the gain is a number
    return c.sensor && unit_of(scene_, *c.sensor) == "rad" && c.spec.gain.is_number();
  }

  // An angle of many turns without a given unit may be in degrees.
  void check_size(const Channel& c, std::size_t row) {
    constexpr double kMany = 100;  // rad: less than a third of a turn in degrees, 16 turns in radians
    if (!is_angle(c) || c.spec.gain.number() != 1 || !c.unit_text.empty()) return;
    const double angle = data_.column(c.spec.column)[row];
    if (!(std::abs(angle) > kMany)) return;
    warn(c.place + ".column",
         fmt::format("{}: '{}' is {:.6g} rad, {:.3g} turns: is the column in degrees? Give its unit in "
                     "the header or in \"unit\" (\"deg\" or \"rad\")",
                     data_.place(row), c.spec.column, angle, std::abs(angle) / (2 * std::numbers::pi)));
  }

  // An unwrapped angle is right if its samples are dense: steps of less than half a turn.
  bool check_unwrapped(const Channel& c, const std::vector<std::size_t>& rows) {
    constexpr double kDoubtful = 0.4;  // of a turn
    const std::vector<double>& measured = data_.column(c.spec.column);
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const double step = std::abs(measured[rows[i]] - measured[rows[i - 1]]) / c.turn();
      if (!(step > kDoubtful)) continue;
      warn(c.place + ".unwrap",
           fmt::format("{}: '{}' still steps by {:.2g} of a turn: steps of half a turn and more cannot be "
                       "told from its jumps, so the unwrapped angle may be wrong from here on",
                       data_.place(rows[i]), c.spec.column, step));
      return true;
    }
    return false;
  }

  // A jump is about a turn, and larger than usual steps of the record. Returns whether there is one.
  bool check_turns(const Channel& c, const std::vector<std::size_t>& rows) {
    if (c.spec.unwrap) return check_unwrapped(c, rows);
    if (!is_angle(c)) return false;
    std::vector<double> measured;
    for (const std::size_t row : rows) measured.push_back(data_.column(c.spec.column)[row]);
    std::size_t wrap = first_wrap(measured, c.turn());
    const bool degrees = wrap == 0 && c.spec.gain.number() == 1 && (wrap = first_wrap(measured, 360)) > 0;
    if (wrap == 0) return false;
    warn(c.place + ".column",
         fmt::format("{}: '{}' jumps from {:.6g} to {:.6g}, by about a turn{}; the sensor '{}' goes on counting. "
                     "Unwrap the column (\"unwrap\": true does)",
                     data_.place(rows[wrap]), c.spec.column, measured[wrap - 1], measured[wrap],
                     degrees ? " in degrees, where rad are expected" : "", c.sensor->name));
    return true;
  }

  const ExperimentSpec& experiment_;
  const std::string& place_;
  const CsvTable& data_;
  const Scene& scene_;
  const double start_, end_ = experiment_.end_time.value_or(std::numeric_limits<double>::infinity());
  std::vector<Channel> channels_;
  std::vector<SceneIssue> issues_;
};

}  // namespace

std::vector<SceneIssue> find_data_issues(const ExperimentSpec& experiment, const std::string& place,
                                         const CsvTable& data, const Scene& scene) {
  return DataCheck(experiment, place, data, scene).issues();
}

}  // namespace mbsopt::inline optim
