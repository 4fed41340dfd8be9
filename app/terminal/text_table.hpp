// A table of a result, once for the terminal and for the page of a report. At the terminal columns have the width of
// their widest cell; numbers stand right, words left. A page shows seven digits at most, and all under the pointer.
//
//   TextTable table({"parameter", "optimum", "unit"});
//   table.add({"L01", "2.146954", "m"});
//   out << table.text(), page.table(table);
//
// The rows may be entries of result.json:
//
//   table_of(result["parameters"], {{"parameter"}, {"optimum", "value", 10}, {"at bound", "at_bound"}})
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/files/json_text.hpp"

namespace mbsopt::inline app {

struct TableCell {
  std::string text, full = {};       // at the terminal; all digits
  std::string brief = {};            // in a page, if it is another text
  std::optional<double> shade = {};  // from -1 to 1: the colour of a heat map
  std::string link = {};
  TableCell(std::string shown, std::string digits = {}) : text(std::move(shown)), full(std::move(digits)) {}
  TableCell(const char* shown) : text(shown) {}
};
using TableRow = std::vector<TableCell>;

class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}
  TableRow& add(TableRow row) { return rows_.emplace_back(std::move(row)); }  // cells that it lacks are empty
  bool empty() const { return rows_.empty(); }
  std::string text() const;
  const std::vector<std::string>& header() const { return header_; }
  const std::vector<TableRow>& rows() const { return rows_; }

 private:
  std::vector<std::string> header_;
  std::vector<TableRow> rows_;
};

// A column shows one entry of each row.
struct TableColumn {
  std::string header;
  std::string key = {};  // "value", "residuals/mean"; empty: the name of the row, or its number in a list
  int digits = 7;
  bool if_any = false;  // left out if no row has the entry
};
// rows: a list or an object of objects.
TextTable table_of(const Json& rows, const std::vector<TableColumn>& columns);

std::string significant(double value, int digits = 7);  // "2.146954", "1.2e-05", "-"  where it is not a number
// A number, a word, an interval, or "-" for none.
std::string cell(const Json& value, int digits = 7);
// The same with all digits of a number; empty for null, "-" for an empty word.
TableCell number_cell(const Json& value, int digits = 6);

}  // namespace mbsopt::inline app
