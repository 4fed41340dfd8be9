// A CSV file: a header row, then numbers. Text is allowed in columns that nobody asks for.
//
//   delimiter   comma, semicolon or tab: the one that separates the header's names
//   decimals    a point; between semicolons or tabs a comma, too, but one of the two in the whole file
//   comments    lines that start with '#'; blank lines are skipped
//   quotes      "a name, with a comma", a quote inside is doubled; a cell ends on its line
//   units       in brackets behind a name, "theta [deg]" or "theta (deg)", or as a row of units below the names
//   missing     an empty cell, NaN with or without a sign, or NA: a NaN here
//   no name     a column without a name, such as an index or what follows a comma at the end of a line
//   line ends   LF, CRLF, CR; a UTF-8 byte-order mark is skipped
//
//   const CsvTable table = read_csv("run1.csv");
//   const std::vector<double>& t = ascending_times(table, "t");   // an error names the row that goes back
//   const std::vector<double>& theta = table.column("theta");
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace mbsopt::inline optim {

// "run1.csv:17:5: ...": the fault, with line and column if there are any.
class CsvError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct CsvTable {
  std::string name;                           // of the file or files, for errors
  std::vector<std::string> header;            // each once
  std::vector<std::vector<double>> columns;   // NaN where a cell is missing
  std::vector<std::size_t> lines;             // the line of each row, counted from 1
  std::vector<std::string> files = {};        // of a table made of several files: their names,
  std::vector<std::size_t> file_of_row = {};  // and the one that each row is of
  std::vector<std::string> faults = {};       // of each column: its first cell that is no number, in words, or empty

  std::size_t rows() const { return lines.size(); }
  std::string place(std::size_t row) const;  // "run1.csv:17"
  // Finds a column by its header, or by its header without the unit in brackets if only one has that name.
  bool has_column(std::string_view column_name) const { return find_column(column_name) < header.size(); }
  std::size_t find_column(std::string_view column_name) const;  // header.size() where there is none
  // Throws CsvError if there is no such column, with the names there are, or if the column has a fault.
  const std::vector<double>& column(std::string_view column_name) const;
};

CsvTable parse_csv(std::string_view text, std::string name);
CsvTable read_csv(const std::string& path);  // throws CsvError, also where it cannot be read

// "theta [deg]": "theta" and "deg". Round brackets hold a unit if it is a known one.
struct ColumnHeader {
  std::string_view name;
  std::optional<std::string_view> unit;
};
ColumnHeader parts_of_header(std::string_view header);

// Returns a column of times: every cell is finite and later than the one before. Throws CsvError with the row.
const std::vector<double>& ascending_times(const CsvTable& table, std::string_view column_name);

}  // namespace mbsopt::inline optim
