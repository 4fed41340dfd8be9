// A table for people: columns have the width of their widest cell; numbers stand right, words left.
//
//   TextTable table({"parameter", "optimum", "unit"});
//   table.add({"L01", "2.146954", "m"});
//   out << table.text();
#pragma once

#include <string>
#include <vector>

namespace mbsopt {

class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }
  std::string text() const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

std::string significant(double value, int digits = 7);  // "2.146954", "1.2e-05", "-"  where it is not a number

}  // namespace mbsopt
