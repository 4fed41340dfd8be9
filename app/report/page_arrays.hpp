// The arrays of numbers that the script of a page reads, each array once.
//
//   PageArrays arrays;
//   arrays.add({0, 0.5, 1});   // 0
//   arrays.add({0, 0.5, 1});   // 0 again
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace mbsopt {

class PageArrays {
 public:
  // Returns the number of the array. Its values have so many digits, and infinite ones become null.
  std::size_t add(const std::vector<double>& values, int digits = 6);
  std::string text() const;  // JSON: [[...], ...]

 private:
  std::map<std::string, std::size_t> numbers_;
  std::vector<std::string> texts_;
};

}  // namespace mbsopt
