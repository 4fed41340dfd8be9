#include "app/report/page_arrays.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "app/report/html_text.hpp"

namespace mbsopt {

std::size_t PageArrays::add(const std::vector<double>& values, int digits) {
  const std::string text = json_list(values, [&](double value) {
    return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : std::string("null");
  });
  const auto [at, is_new] = numbers_.emplace(text, texts_.size());
  if (is_new) texts_.push_back(at->first);
  return at->second;
}

std::string PageArrays::text() const { return fmt::format("[{}]", fmt::join(texts_, ",\n")); }

}  // namespace mbsopt
