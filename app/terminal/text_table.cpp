#include "app/terminal/text_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbsopt::inline app {
namespace {

bool looks_like_a_number(const std::string& cell) {
  return cell.empty() || cell == "-" || cell.find_first_of("0123456789") == 0 ||
         (cell.size() > 1 && (cell[0] == '-' || cell[0] == '+' || cell[0] == '[') && cell[1] >= '0' &&
          cell[1] <= '9') ||
         cell.starts_with("[-");
}

// The width of UTF-8 text on a terminal: its code points.
std::size_t width(const std::string& cell) {
  return static_cast<std::size_t>(std::count_if(cell.begin(), cell.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string padded(const std::string& cell, std::size_t to, bool right) {
  const std::string spaces(to - std::min(to, width(cell)), ' ');
  return right ? spaces + cell : cell + spaces;
}

}  // namespace

std::string TextTable::text() const {
  const std::size_t columns = header_.size();
  const auto cell_of = [](const TableRow& row, std::size_t c) { return c < row.size() ? row[c].text : std::string(); };
  std::vector<std::size_t> widths(columns);
  std::vector<bool> numeric(columns, !rows_.empty());
  for (std::size_t c = 0; c < columns; ++c) {
    widths[c] = width(header_[c]);
    for (const TableRow& row : rows_) {
      widths[c] = std::max(widths[c], width(cell_of(row, c)));
      if (!looks_like_a_number(cell_of(row, c))) numeric[c] = false;
    }
  }
  std::string text;
  const auto add_line = [&](const TableRow& row) {
    for (std::size_t c = 0; c < columns; ++c)
      text += (c == 0 ? "" : "  ") + padded(cell_of(row, c), widths[c], numeric[c]);
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  };
  add_line({header_.begin(), header_.end()});
  for (const TableRow& row : rows_) add_line(row);
  return text;
}

TextTable table_of(const Json& rows, const std::vector<TableColumn>& columns) {
  std::vector<TableColumn> shown;
  std::vector<std::string> header;
  const auto pointer = [](const TableColumn& column) { return Json::json_pointer("/" + column.key); };
  for (const TableColumn& column : columns) {
    const auto has_it = [&](const Json& row) {
      return row.contains(pointer(column)) && !row[pointer(column)].is_null();
    };
    if (column.if_any && std::none_of(rows.begin(), rows.end(), has_it)) continue;
    header.push_back(column.header);
    shown.push_back(column);
  }
  TextTable table(header);
  for (const auto& [name, entries] : rows.items()) {
    TableRow& row = table.add({});
    for (const TableColumn& column : shown)
      row.push_back(column.key.empty() ? rows.is_array() ? std::to_string(table.rows().size()) : name
                                       : number_cell(entries.value(pointer(column), Json()), column.digits));
  }
  return table;
}

std::string significant(double value, int digits) {
  return std::isnan(value) ? "-" : fmt::format("{:.{}g}", value, digits);
}

std::string cell(const Json& value, int digits) {
  if (value.is_number_integer()) return std::to_string(value.get<long>());
  if (value.is_number()) return significant(value.get<double>(), digits);
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (!value.is_array()) return "-";
  std::string text;
  for (const Json& element : value) text += (text.empty() ? "" : ", ") + cell(element, digits);
  return text.empty() ? "none" : text;
}

TableCell number_cell(const Json& value, int digits) {
  constexpr int kBrief = 7;  // digits in a page
  if (value.is_null()) return "";
  if (value == "") return "-";
  TableCell shown = cell(value, digits);
  if (!value.is_number_float() || !std::isfinite(value.get<double>())) return shown;
  shown.full = fmt::format("{}", value.get<double>());
  if (digits > kBrief) shown.brief = cell(value, kBrief);
  return shown;
}

}  // namespace mbsopt::inline app
