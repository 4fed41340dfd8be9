#include "app/import/unique_names.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/expression/operation.hpp"

namespace mbsopt::inline app {

std::string UniqueNames::add(const std::string& wanted) {
  const bool identifier = kind_ == Kind::identifier;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_refused = [&](char c) {
    if (identifier) return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c));
    return static_cast<unsigned char>(c) < ' ' || std::string(".,;\"'[]/\\").find(c) != std::string::npos;
  };
  std::string stem = wanted;
  std::ranges::replace_if(stem, is_refused, '_');
  if (identifier && (stem.empty() || is_digit(stem[0]))) stem.insert(0, "_");
  if (stem.empty()) stem = "unnamed";
  std::string name = stem;
  for (int k = 2; std::ranges::find(taken_, name) != taken_.end() || find_function(name); ++k)
    name = fmt::format("{}_{}", stem, k);
  taken_.push_back(name);
  if (renamed_ && name != wanted) renamed_->push_back(fmt::format("'{}' is named '{}'", wanted, name));
  return name;
}

}  // namespace mbsopt::inline app
