// Text in HTML.
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace mbsopt::inline app {

inline std::string html_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const std::size_t special = std::string_view("&<>\"").find(c);
    escaped +=
        special == std::string_view::npos ? std::string(1, c) : std::array{"&amp;", "&lt;", "&gt;", "&quot;"}[special];
  }
  return escaped;
}

}  // namespace mbsopt::inline app
