#include "optim/problem/logged_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>

namespace mbsopt::inline optim {
namespace {

constexpr double kStandardGravity = 9.80665;  // m/s^2, exact (CGPM 1901)
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

struct ColumnUnit {
  std::string text;  // empty: none is known
  Unit unit;
};

// The unit that the file states for a column, or the one of its header; empty if neither does.
std::string stated(const std::string& header, const std::string& given) {
  return given.empty() ? std::string(parts_of_header(header).unit.value_or("")) : given;
}

// Throws with the names of the columns if there is no such column.
ColumnUnit unit_of(const CsvTable& table, std::string_view column, const std::string& given) {
  table.column(column);
  const std::string& header = table.header[table.find_column(column)];
  const std::string text = stated(header, given);
  if (text.empty()) return {};
  const std::optional<Unit> unit = parse_column_unit(text);
  if (!unit)
    throw CsvError(
        fmt::format("{}: column '{}': '{}' is not a known unit; give its unit beside the column (\"1\" for a "
                    "number); known are products, quotients and whole powers of {}",
                    table.name, header, text, known_units()));
  return {text, *unit};
}

// Removes jumps of more than half a turn from one sample to the next.
void unwrap(std::vector<double>& values, double turn) {
  double last = kMissing, turns = 0;
  for (double& value : values) {
    if (std::isnan(value)) continue;
    const double given = value;
    if (!std::isnan(last)) turns -= std::round((given - last) / turn);
    last = given;
    value = given + turns * turn;
  }
}

// The time column, then the channels' columns, of several tables.
CsvTable merged(const std::vector<CsvTable>& tables, const std::vector<std::string>& columns) {
  CsvTable all;
  all.header = columns;
  all.columns.resize(columns.size());
  for (const CsvTable& table : tables) {
    all.name += (all.name.empty() ? "" : ", ") + table.name;
    all.files.push_back(table.name);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::size_t from = table.find_column(columns[c]);
      if (from < table.header.size()) {
        std::ranges::copy(table.columns[from], std::back_inserter(all.columns[c]));
        all.header[c] = table.header[from];  // with its unit
      } else {
        all.columns[c].insert(all.columns[c].end(), table.rows(), kMissing);
      }
    }
    std::ranges::copy(table.lines, std::back_inserter(all.lines));
    all.file_of_row.insert(all.file_of_row.end(), table.rows(), all.files.size() - 1);
  }
  std::vector<std::size_t> order(all.rows());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::vector<double>& t = all.columns[0];
  std::ranges::stable_sort(order, {}, [&](std::size_t row) { return t[row]; });
  // Rows of one time become one row. Each cell of it may come from one file only.
  CsvTable sorted{all.name, all.header, std::vector<std::vector<double>>(columns.size()), {}, all.files, {}};
  constexpr double kRounding = 1e-9;  // of the record's length, beyond what any logger resolves
  const double rounding = order.empty() ? 0 : kRounding * (t[order.back()] - t[order.front()]);
  for (const std::size_t row : order) {
    if (sorted.lines.empty() || t[row] - sorted.columns[0].back() > rounding) {
      sorted.columns[0].push_back(t[row]);
      for (std::size_t c = 1; c < columns.size(); ++c) sorted.columns[c].push_back(kMissing);
      sorted.lines.push_back(all.lines[row]);
      sorted.file_of_row.push_back(all.file_of_row[row]);
    }
    for (std::size_t c = 1; c < columns.size(); ++c) {
      const double value = all.columns[c][row];
      double& cell = sorted.columns[c].back();
      if (!std::isnan(value) && !std::isnan(cell))
        throw CsvError(fmt::format("{}: column '{}' has a sample at {} s, and so has {}; samples must not count twice",
                                   all.place(row), columns[c], t[row], sorted.place(sorted.rows() - 1)));
      if (!std::isnan(value)) cell = value;
    }
  }
  return sorted;
}

}  // namespace

std::optional<Unit> parse_column_unit(std::string_view text) {
  if (text == "g") return Unit{kStandardGravity, dimension::kAcceleration};
  if (text == "mg") return Unit{1e-3 * kStandardGravity, dimension::kAcceleration};
  return parse_unit(text);
}

std::string stated_unit(const ChannelSpec& channel, const CsvTable& table) {
  const std::size_t column = table.find_column(channel.column);
  return stated(column < table.header.size() ? table.header[column] : "", channel.unit);
}

LoggedColumn column_in_si(const CsvTable& table, std::string_view column, const std::string& given) {
  LoggedColumn result{table.column(column), {}, {}};
  const auto [text, unit] = unit_of(table, column, given);
  const std::string si = unit.dimension.is_none() ? "1" : to_string(unit.dimension);
  if (!text.empty()) result.unit = si;
  if (unit.to_si == 1) return result;
  for (double& value : result.values) value *= unit.to_si;
  result.read = fmt::format("{}: column '{}' converted from {} to {}", table.name, column, text, si);
  return result;
}

LoggedColumn times_in_seconds(const CsvTable& table, std::string_view column, const std::string& given,
                              std::optional<double> time_zero) {
  LoggedColumn result{ascending_times(table, column), {}, {}};
  const auto [text, unit] = unit_of(table, column, given);
  if (!text.empty() && !compatible(unit.dimension, dimension::kTime))
    throw CsvError(fmt::format("{}: column '{}': '{}' is no unit of time", table.name, column, text));
  result.unit = "s";
  const bool first = time_zero == SampleColumn::kFirstRow;
  // The zero is subtracted before the conversion: stamps of a clock have few digits behind the point.
  const double zero = first ? (result.values.empty() ? 0 : result.values.front()) : time_zero.value_or(0) / unit.to_si;
  if (zero == 0 && unit.to_si == 1) return result;
  for (double& t : result.values) t = (t - zero) * unit.to_si;
  result.read = fmt::format("{}: times '{}'", table.name, column);
  if (unit.to_si != 1) result.read += fmt::format(" converted from {} to s", text);
  if (zero != 0) result.read += fmt::format("{} t = 0 is {} of the file", unit.to_si == 1 ? ":" : ",", zero);
  return result;
}

void read_curve(SampleColumn& samples, Interpolation how, bool missing, bool by_row, const CsvTable& table,
                std::vector<std::string>& read) {
  LoggedColumn times;
  if (!by_row) times = times_in_seconds(table, samples.time, samples.time_unit, samples.time_zero);
  LoggedColumn values = column_in_si(table, samples.column, samples.unit);
  for (const std::string& words : {times.read, values.read})
    if (!words.empty()) read.push_back(words);
  samples.unit = values.unit;
  std::vector<double> x, y;
  x.reserve(values.values.size());
  y.reserve(values.values.size());
  for (std::size_t row = 0; row < values.values.size(); ++row) {
    if (std::isfinite(values.values[row])) {
      x.push_back(by_row ? static_cast<double>(row) : times.values[row]);
      y.push_back(values.values[row]);
    } else if (!missing) {
      throw CsvError(
          fmt::format("{}: column '{}' has no number here; a law needs all of them", table.place(row), samples.column));
    }
  }
  if (x.size() < 2) throw CsvError(table.name + ": a law needs two rows or more");
  try {
    samples.curve = std::make_shared<const Curve>(how, std::move(x), std::move(y));
  } catch (const std::invalid_argument& error) {
    throw CsvError(fmt::format("{}: column '{}': {}", table.name, samples.column, error.what()));
  }
}

CsvTable read_record(const ExperimentSpec& experiment, std::vector<std::string>* read) {
  std::vector<CsvTable> tables;
  std::optional<double> time_zero = experiment.time_zero;
  const auto note = [&](const std::string& words) {
    if (read && !words.empty()) read->push_back(words);
  };
  const bool one = experiment.data.size() == 1;
  for (const std::string& file : experiment.data) {
    CsvTable& table = tables.emplace_back(read_csv(file));
    if (one && !table.has_column(experiment.time)) return std::move(table);  // the user of the column reports it
    LoggedColumn times = times_in_seconds(table, experiment.time, experiment.time_unit, time_zero);
    const std::size_t clock = table.find_column(experiment.time);
    if (time_zero == SampleColumn::kFirstRow)  // all files have one clock, which starts with the first of them
      time_zero = table.rows() == 0
                      ? 0
                      : table.columns[clock].front() * unit_of(table, experiment.time, experiment.time_unit).unit.to_si;
    note(times.read);
    std::set<std::size_t> converted{clock};
    for (const ChannelSpec& channel : experiment.channels) {
      const std::size_t column = table.find_column(channel.column);
      if (column == table.header.size() || !converted.insert(column).second) continue;
      LoggedColumn values = column_in_si(table, channel.column, channel.unit);
      note(values.read);
      table.columns[column] = std::move(values.values);
    }
    table.columns[clock] = std::move(times.values);
  }
  if (!one) {
    std::vector<std::string> columns{experiment.time};
    for (const ChannelSpec& channel : experiment.channels) {
      const auto has = [&](const CsvTable& table) { return table.has_column(channel.column); };
      if (std::ranges::none_of(tables, has)) tables.front().column(channel.column);  // throws, with the names there are
      if (std::ranges::find(columns, channel.column) == columns.end()) columns.push_back(channel.column);
    }
    tables = {merged(tables, columns)};
  }
  CsvTable& record = tables.front();
  for (const ChannelSpec& channel : experiment.channels) {
    const std::size_t column = record.find_column(channel.column);
    if (!channel.unwrap || column == record.header.size() || column == record.find_column(experiment.time)) continue;
    unwrap(record.columns[column],
           2 * std::numbers::pi * (channel.gain.is_number() ? std::abs(channel.gain.number()) : 1));
  }
  return std::move(record);
}

}  // namespace mbsopt::inline optim
