// Writes counts for sentences: "1 step", "3 steps", "2 bodies".
#pragma once

#include <concepts>
#include <string>
#include <string_view>

namespace mbsopt {

// many is the plural if it is not `one` with an s.
std::string counted(std::integral auto count, std::string_view one, std::string_view many = "") {
  std::string text = std::to_string(count) + ' ';
  if (count == 1) return text += one;
  return many.empty() ? (text += one) += 's' : text += many;
}

}  // namespace mbsopt
