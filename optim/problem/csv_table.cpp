#include "optim/problem/csv_table.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/expression/counted.hpp"
#include "core/expression/did_you_mean.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return result;
}

struct Cell {
  std::string text;
  std::size_t column = 1;  // of its first character, counted from 1
};

class Reader {
 public:
  Reader(std::string_view text, CsvTable& table) : rest_(text), table_(table) {
    if (rest_.substr(0, 3) == "\xEF\xBB\xBF") rest_.remove_prefix(3);
  }

  void read() {
    if (!next_line()) throw CsvError(table_.name + ": is empty; a header row with the columns' names is needed");
    find_delimiter();
    read_header();
    while (next_line()) read_row();
  }

 private:
  // Reads the next line that is neither blank nor a comment.
  bool next_line() {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      current_ = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++line_;
      while (!current_.empty() && current_.back() == '\r') current_.remove_suffix(1);
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
      if (cell.text.empty()) fail(cell.column, "a column without a name in the header");
      if (!seen.insert(cell.text).second) fail(cell.column, "the column '" + cell.text + "' appears twice");
      table_.header.push_back(cell.text);
    }
    double number = 0;
    if (std::all_of(cells_.begin(), cells_.end(),
                    [&](const Cell& c) { return is_number(c.text, number) || is_decimal_comma(c.text); }))
      fail(1, "the first row must hold the columns' names, found numbers");
    table_.columns.resize(table_.header.size());
  }

  void read_row() {
    split();
    if (cells_.size() != table_.header.size())
      fail(1, fmt::format("the row has {}, the header {}{}", counted(cells_.size(), "cell"), table_.header.size(),
                          delimiter_ == ',' && cells_.size() > table_.header.size()
                              ? " (where decimals have a comma, cells need a semicolon or a tab between them)"
                              : ""));
    for (std::size_t k = 0; k < cells_.size(); ++k) table_.columns[k].push_back(number(cells_[k], table_.header[k]));
    table_.lines.push_back(line_);
  }

  static bool is_number(std::string_view text, double& value) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = fast_float::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && !text.empty();
  }

  // Returns whether a text such as "1,5" is a number with a decimal comma.
  static bool is_decimal_comma(std::string text) {
    std::replace(text.begin(), text.end(), ',', '.');
    double number = 0;
    return is_number(text, number);
  }

  double number(const Cell& cell, const std::string& column) {
    const std::string word = lower_case(cell.text);
    if (word.empty() || word == "nan" || word == "na") return std::numeric_limits<double>::quiet_NaN();
    double value = 0;
    if (is_number(with_point(cell, column), value) && std::isfinite(value)) return value;
    fail(cell.column, fmt::format("column '{}': '{}' is not a finite number", column, cell.text));
  }

  // The cell's text with a decimal point. The first point or comma of the file decides for all others.
  std::string with_point(const Cell& cell, const std::string& column) {
    const std::size_t mark = cell.text.find_first_of(".,");
    if (mark == std::string::npos) return cell.text;
    const char found = cell.text[mark];
    const auto refuse = [&](const std::string& why) {
      fail(cell.column, fmt::format("column '{}': '{}' {}", column, cell.text, why));
    };
    if (cell.text.find_first_of(".,", mark + 1) != std::string::npos)
      refuse("has more than one point or comma; thousands are not separated");
    if (found == ',' && delimiter_ == ',')
      refuse("has a decimal comma, which needs a semicolon or a tab between cells");
    if (decimal_ == 0) decimal_ = found, decimal_line_ = line_;
    if (decimal_ != found)
      refuse(fmt::format("has a decimal {}, line {} a decimal {}; a file has one of them", name_of(found),
                         decimal_line_, name_of(decimal_)));
    std::string text = cell.text;
    text[mark] = '.';
    return text;
  }

  static const char* name_of(char decimal) { return decimal == ',' ? "comma" : "point"; }

  [[noreturn]] void fail(std::size_t column, const std::string& what) const {
    throw CsvError(fmt::format("{}:{}:{}: {}", table_.name, line_, column, what));
  }

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
  const std::size_t opening = header.rfind('[');
  if (opening == std::string_view::npos || header.back() != ']') return {header, std::nullopt};
  return {trimmed(header.substr(0, opening)), trimmed(header.substr(opening + 1, header.size() - opening - 2))};
}

std::string CsvTable::place(std::size_t row) const {
  return fmt::format("{}:{}", files.empty() ? name : files[file_of_row[row]], lines[row]);
}

std::size_t CsvTable::find_column(std::string_view column_name) const {
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
    std::vector<std::string> names = header;
    for (const std::string& text : header) names.emplace_back(parts_of_header(text).name);
    throw CsvError(fmt::format("{}: has no column '{}'{}; its columns: {}", name, column_name,
                               did_you_mean(column_name, names), joined(header)));
  }
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

}  // namespace mbsopt
