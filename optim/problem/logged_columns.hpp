// Columns of a logger's file in SI: units from the header ("theta [deg]") or given, times from any clock.
//
//   value = file value * unit            time = (file time - time_zero) * unit
//
// In a column, "g" is the standard acceleration of gravity and "mg" a thousandth of it: loggers write accelerations in
// these units, and masses do not change.
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

namespace mbsopt::inline optim {

std::optional<Unit> parse_column_unit(std::string_view text);
// The unit of a channel's column as the problem or the file states it; empty: neither does.
std::string stated_unit(const ChannelSpec& channel, const CsvTable& table);

struct LoggedColumn {
  std::vector<double> values;
  std::string unit;  // SI unit of the values; empty: none is known
  std::string read;  // the conversion in words, or empty
};

// given is a unit that replaces the header's, or empty. Throw CsvError.
LoggedColumn column_in_si(const CsvTable& table, std::string_view column, const std::string& given);
LoggedColumn times_in_seconds(const CsvTable& table, std::string_view column, const std::string& given,
                              std::optional<double> time_zero);

// Reads the curve through the rows of a table that have a number, and sets the SI unit. `missing` allows rows without
// one. `by_row` takes the number of the row, from 0, in place of the time.
void read_curve(SampleColumn& samples, Interpolation how, bool missing, bool by_row, const CsvTable& table,
                std::vector<std::string>& read);

// The files of an experiment as one table in the order of time. Its used columns are in SI, and angles are unwrapped on
// request. read receives the conversions. Throws CsvError.
CsvTable read_record(const ExperimentSpec& experiment, std::vector<std::string>* read = nullptr);

}  // namespace mbsopt::inline optim
