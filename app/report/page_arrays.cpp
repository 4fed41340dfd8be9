#include "app/report/page_arrays.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace mbsopt {

std::size_t PageArrays::add(const std::vector<double>& values, int digits) {
  std::string text = "[";
  for (const double value : values) {
    if (text.size() > 1) text += ',';
    if (std::isfinite(value)) {
      text += fmt::format("{:.{}g}", value, digits);
    } else {
      text += "null";
    }
  }
  const auto [at, is_new] = numbers_.emplace(text + "]", texts_.size());
  if (is_new) texts_.push_back(at->first);
  return at->second;
}

std::string PageArrays::text() const { return fmt::format("[{}]", fmt::join(texts_, ",\n")); }

}  // namespace mbsopt
