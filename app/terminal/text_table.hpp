// A table for people: columns have the width of their widest cell; numbers stand right, words left.
//
//   TextTable table({"parameter", "optimum", "unit"});
//   table.add({"L01", "2.146954", "m"});
//   out << table.text();
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace mbsopt::inline app {

class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}
  void add(std::vector<std::string> row);  // cells that it lacks are empty
  bool empty() const { return rows_.empty(); }
  // Leaves out those of the named columns that have empty cells only.
  std::string text(const std::vector<std::string>& unless_empty = {}) const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

std::string significant(double value, int digits = 7);  // "2.146954", "1.2e-05", "-"  where it is not a number
std::string or_blank(const std::optional<double>& value, int digits = 7);

}  // namespace mbsopt::inline app
