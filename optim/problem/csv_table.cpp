#include "optim/problem/csv_table.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <unordered_set>

#include "core/expression/counted.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/expression/dimension.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline optim {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
  return text.substr(first, text.find_last_not_of(" \t") + 1 - first);
}

struct Cell {
  std::string text;
  std::size_t column = 1;  // of its first character, counted from 1
};

class Reader {
 public:
  Reader(std::string_view text, CsvTable& table) : rest_(text), table_(table) {
    if (rest_.substr(0, 3) == "\xEF\xBB\xBF") rest_.remove_prefix(3);
    const std::string_view mark = rest_.substr(0, 2);
    if (mark == "\xFF\xFE" || mark == "\xFE\xFF" ||
        rest_.substr(0, rest_.find('\n')).find('\0') != std::string_view::npos)
      throw CsvError(table_.name + ": is text of 16 or more bits per character (UTF-16); save it as UTF-8");
  }

  void read() {
    if (!next_line()) throw CsvError(table_.name + ": is empty; a header row with the columns' names is needed");
    find_delimiter();
    read_header();
    if (!next_line() || (split(), read_units() && !next_line())) return;
    do {
      split();
      read_row();
    } while (next_line());
  }

 private:
  // Reads the next line that is neither blank nor a comment.
  bool next_line() {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
      const std::size_t ends = rest_.substr(end, 2) == "\r\n" ? 2 : 1;
      current_ = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + ends, rest_.size()));
      ++line_;
      const std::string_view content = trimmed(current_);
      if (!content.empty() && content.front() != '#') return true;
    }
    return false;
  }

  // A tab or a semicolon in the header beats a comma, which may be part of a name ("force, left").
  void find_delimiter() {
    bool quoted = false, tab = false, semicolon = false;
    for (const char c : current_) {
      if (c == '"') quoted = !quoted;
      tab = tab || (!quoted && c == '\t');
      semicolon = semicolon || (!quoted && c == ';');
    }
    delimiter_ = tab ? '\t' : semicolon ? ';' : ',';
  }

  void split() {
    cells_.clear();
    std::size_t i = 0;
    for (;;) {
      Cell cell;
      while (i < current_.size() && is_blank(current_[i]) && current_[i] != delimiter_) ++i;
      cell.column = i + 1;
      if (i < current_.size() && current_[i] == '"') {
        i = quoted_cell(i, cell.text);
      } else {
        const std::size_t end = std::min(current_.find(delimiter_, i), current_.size());
        cell.text = trimmed(current_.substr(i, end - i));
        i = end;
      }
      cells_.push_back(std::move(cell));
      if (i >= current_.size()) return;
      ++i;  // the delimiter
    }
  }

  // Reads from the opening quote to the delimiter or the end of the line.
  std::size_t quoted_cell(std::size_t i, std::string& text) const {
    const std::size_t start = i++;
    for (;; ++i) {
      if (i >= current_.size()) fail(start + 1, "the quote is not closed on its line");
      if (current_[i] != '"') {
        text += current_[i];
      } else if (i + 1 < current_.size() && current_[i + 1] == '"') {
        text += current_[i++];
      } else {
        break;
      }
    }
    ++i;
    while (i < current_.size() && is_blank(current_[i]) && current_[i] != delimiter_) ++i;
    if (i < current_.size() && current_[i] != delimiter_)
      fail(i + 1, fmt::format("found '{}' after a closing quote, where the cell must end", current_[i]));
    return i;
  }

  void read_header() {
    split();
    std::unordered_set<std::string> seen;
    for (const Cell& cell : cells_) {
      if (!cell.text.empty() && !seen.insert(cell.text).second)
        fail(cell.column, "the column '" + cell.text + "' appears twice");
      table_.header.push_back(cell.text);
    }
    if (std::ranges::all_of(cells_, looks_like_number))
      fail(1, "the first row must hold the columns' names, found numbers");
    table_.columns.resize(table_.header.size());
    table_.faults.resize(table_.header.size());
  }

  // Reads a row of units below the names, and puts each unit behind its name. Returns whether there is such a row.
  bool read_units() {
    const auto is_text = [](const Cell& c) { return !looks_like_number(c) && !is_missing(c.text); };
    const auto is_empty = [](const Cell& c) { return c.text.empty(); };
    const auto is_text_or_empty = [&](const Cell& c) { return is_text(c) || is_empty(c); };
    if (!std::ranges::all_of(cells_, is_text_or_empty) || std::ranges::all_of(cells_, is_empty)) return false;
    for (std::size_t k = 0; k < std::min(cells_.size(), table_.header.size()); ++k) {
      std::string_view unit = cells_[k].text;
      if (unit.size() > 2 && (unit.front() == '[' || unit.front() == '(')) unit = unit.substr(1, unit.size() - 2);
      if (unit.empty() || unit == "-") continue;
      if (!parse_unit(unit))
        fail(cells_[k].column,
             fmt::format("the row below the names has no numbers, and '{}' is no known unit; a '#' in front of the row "
                         "leaves it out",
                         cells_[k].text));
      std::string& name = table_.header[k];
      if (!name.empty() && !parts_of_header(name).unit) name += fmt::format(" [{}]", unit);
    }
    return true;
  }

  // Empty cells may stand behind the last named column, in the header or in the rows.
  void read_row() {
    std::size_t named = table_.header.size();
    while (named > 0 && table_.header[named - 1].empty()) --named;
    while (cells_.size() > table_.header.size() && cells_.back().text.empty()) cells_.pop_back();
    while (cells_.size() < table_.header.size() && cells_.size() >= named) cells_.emplace_back();
    if (cells_.size() != table_.header.size())
      fail(1, fmt::format("the row has {}, the header {}{}", counted(cells_.size(), "cell"), table_.header.size(),
                          delimiter_ == ',' && cells_.size() > table_.header.size()
                              ? " (where decimals have a comma, cells need a semicolon or a tab between them)"
                              : ""));
    for (std::size_t k = 0; k < cells_.size(); ++k) table_.columns[k].push_back(number(cells_[k], k));
    table_.lines.push_back(line_);
  }

  static bool is_number(std::string_view text, double& value) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = fast_float::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && !text.empty();
  }

  // Returns whether a cell is a number, with a decimal comma too, or empty.
  static bool looks_like_number(const Cell& cell) {
    std::string text = cell.text;
    std::replace(text.begin(), text.end(), ',', '.');
    double number = 0;
    return text.empty() || is_number(text, number);
  }

  // An empty cell, and the words of programs for "no number": nan, -nan, nan(ind), NA.
  static bool is_missing(std::string_view text) {
    if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
    std::string word(text);
    std::ranges::transform(word, word.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
    return word.empty() || word == "nan" || word == "na" || word == "n/a" || word.starts_with("nan(");
  }

  // The number of a cell, or NaN. A column keeps its first fault, which matters only if the column is used. The first
  // point or comma between digits decides for all numbers of the file.
  double number(const Cell& cell, std::size_t k) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    if (!table_.faults[k].empty() || is_missing(cell.text)) return kNaN;
    const auto refuse = [&](const std::string& why) {
      table_.faults[k] = at(cell.column, fmt::format("column '{}': '{}' {}", table_.header[k], cell.text, why));
      return kNaN;
    };
    std::string text = cell.text;
    const std::size_t mark = text.find_first_of(".,");
    if (mark != std::string::npos && text.find_first_of(".,", mark + 1) != std::string::npos)
      return refuse("has more than one point or comma; thousands are not separated");
    const char found = mark == std::string::npos ? '\0' : text[mark];
    if (found) text[mark] = '.';
    double value = 0;
    if (!is_number(text, value) || !std::isfinite(value)) return refuse("is not a finite number");
    if (found == ',' && delimiter_ == ',')
      return refuse("has a decimal comma, which needs a semicolon or a tab between cells");
    if (found && decimal_ == 0) {
      decimal_ = found;
      decimal_line_ = line_;
    }
    if (found && decimal_ != found)
      return refuse(fmt::format("has a decimal {}, line {} a decimal {}; a file has one of them", name_of(found),
                                decimal_line_, name_of(decimal_)));
    return value;
  }

  static const char* name_of(char decimal) { return decimal == ',' ? "comma" : "point"; }

  std::string at(std::size_t column, const std::string& what) const {
    return fmt::format("{}:{}:{}: {}", table_.name, line_, column, what);
  }
  [[noreturn]] void fail(std::size_t column, const std::string& what) const { throw CsvError(at(column, what)); }

  std::string_view rest_, current_;
  std::size_t line_ = 0;
  char delimiter_ = ',';
  char decimal_ = 0;  // not seen yet
  std::size_t decimal_line_ = 0;
  std::vector<Cell> cells_;
  CsvTable& table_;
};

}  // namespace

ColumnHeader parts_of_header(std::string_view header) {
  for (const std::string_view brackets : {"[]", "()"}) {
    const std::size_t opening = header.rfind(brackets[0]);
    if (opening == std::string_view::npos || header.back() != brackets[1]) continue;
    const std::string_view unit = trimmed(header.substr(opening + 1, header.size() - opening - 2));
    if (brackets[0] == '[' || parse_unit(unit)) return {trimmed(header.substr(0, opening)), unit};
  }
  return {header, std::nullopt};
}

std::string CsvTable::place(std::size_t row) const {
  return fmt::format("{}:{}", files.empty() ? name : files[file_of_row[row]], lines[row]);
}

std::size_t CsvTable::find_column(std::string_view column_name) const {
  if (column_name.empty()) return header.size();
  const auto exact = std::find(header.begin(), header.end(), column_name);
  if (exact != header.end()) return static_cast<std::size_t>(exact - header.begin());
  const auto is_named = [&](const std::string& text) { return parts_of_header(text).name == column_name; };
  const auto first = std::find_if(header.begin(), header.end(), is_named);
  const bool once = first != header.end() && std::none_of(first + 1, header.end(), is_named);
  return once ? static_cast<std::size_t>(first - header.begin()) : header.size();
}

const std::vector<double>& CsvTable::column(std::string_view column_name) const {
  const std::size_t found = find_column(column_name);
  if (found == header.size()) {
    std::vector<std::string> named = header;
    std::erase(named, "");
    std::vector<std::string> names = named;
    for (const std::string& text : named) names.emplace_back(parts_of_header(text).name);
    throw CsvError(fmt::format("{}: has no column '{}'{}; its columns: {}", name, column_name,
                               did_you_mean(column_name, names), joined(named)));
  }
  if (found < faults.size() && !faults[found].empty()) throw CsvError(faults[found]);
  return columns[found];
}

CsvTable parse_csv(std::string_view text, std::string name) {
  CsvTable table;
  table.name = std::move(name);
  Reader(text, table).read();
  return table;
}

CsvTable read_csv(const std::string& path) {
  try {
    return parse_csv(content_of_regular_file(path), path);
  } catch (const FileError& error) {
    throw CsvError(path + ": " + error.what());
  } catch (const std::bad_alloc&) {
    throw CsvError(path + ": is too large for the memory of this machine");
  }
}

const std::vector<double>& ascending_times(const CsvTable& table, std::string_view column_name) {
  const std::vector<double>& t = table.column(column_name);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (!std::isfinite(t[i]))
      throw CsvError(fmt::format("{}: the time in column '{}' is missing", table.place(i), column_name));
    if (i > 0 && !(t[i] > t[i - 1]))
      throw CsvError(fmt::format("{}: column '{}': {} comes after {}; times must be ascending", table.place(i),
                                 column_name, t[i], t[i - 1]));
  }
  return t;
}

}  // namespace mbsopt::inline optim
