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

void TextTable::add(std::vector<std::string> row) {
  row.resize(header_.size());
  rows_.push_back(std::move(row));
}

std::string TextTable::text(const std::vector<std::string>& unless_empty) const {
  const std::size_t columns = header_.size();
  const auto is_shown = [&](std::size_t c) {
    return std::ranges::find(unless_empty, header_[c]) == unless_empty.end() ||
           std::ranges::any_of(rows_, [c](const auto& row) { return !row[c].empty(); });
  };
  std::vector<bool> shown(columns);
  for (std::size_t c = 0; c < columns; ++c) shown[c] = is_shown(c);
  std::vector<std::size_t> widths(columns);
  std::vector<bool> numeric(columns, true);
  for (std::size_t c = 0; c < columns; ++c) widths[c] = width(header_[c]);
  for (const auto& row : rows_) {
    for (std::size_t c = 0; c < columns; ++c) {
      widths[c] = std::max(widths[c], width(row[c]));
      if (!looks_like_a_number(row[c])) numeric[c] = false;
    }
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string out;
    for (std::size_t c = 0; c < columns; ++c) {
      if (!shown[c]) continue;
      out += (c == 0 ? "" : "  ") + padded(cells[c], widths[c], numeric[c] && !rows_.empty());
    }
    out.erase(out.find_last_not_of(' ') + 1);
    return out + "\n";
  };
  std::string text = line(header_);
  for (const auto& row : rows_) text += line(row);
  return text;
}

std::string significant(double value, int digits) {
  return std::isnan(value) ? "-" : fmt::format("{:.{}g}", value, digits);
}

std::string or_blank(const std::optional<double>& value, int digits) {
  return value ? significant(*value, digits) : std::string();
}

}  // namespace mbsopt::inline app
