// Columns as a logger wrote them, in SI: units from the header ("theta [deg]") or given, times from any clock.
//
//   value = file value * unit            time = (file time - time_zero) * unit
// In a column, "g" is the standard acceleration of gravity and "mg" a thousandth of it: loggers write accelerations so,
// and masses do not change.
//
//   const LoggedColumn tau = column_in_si(table, "tau");          // of "tau [N mm]": N m
//   const LoggedColumn t = times_in_seconds(table, "stamp", "ms", SampleColumn::kFirstRow);
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/dimension.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

std::optional<Unit> parse_column_unit(std::string_view text);
// The unit of a channel's column as the problem or the file states it; empty: neither does.
std::string stated_unit(const ChannelSpec& channel, const CsvTable& table);

struct LoggedColumn {
  std::vector<double> values;
  std::string unit;  // SI unit of the values; empty: none is known
  std::string read;  // what was converted, in words; empty: nothing
};

// given: a unit instead of the header's; empty: none. Throw CsvError.
LoggedColumn column_in_si(const CsvTable& table, std::string_view column, const std::string& given);
LoggedColumn times_in_seconds(const CsvTable& table, std::string_view column, const std::string& given,
                              std::optional<double> time_zero);

// The curve through the rows of a table that have a number; missing: whether rows may have none; by_row: over the
// number of the row, from 0, not over time. Sets the SI unit, too.
void read_curve(SampleColumn& samples, Interpolation how, bool missing, bool by_row, const CsvTable& table,
                std::vector<std::string>& read);

// The files of an experiment as one table in the order of time, its used columns in SI, angles unwrapped where wanted.
// read: what was converted. Throws CsvError.
CsvTable read_record(const ExperimentSpec& experiment, std::vector<std::string>* read = nullptr);

}  // namespace mbsopt
