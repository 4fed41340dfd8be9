// Text in HTML.
#pragma once

#include <string>
#include <string_view>

namespace mbsopt::inline app {

std::string html_escaped(std::string_view text);
std::string html_words(std::string_view text);  // escaped; no line ends within "1e-9" or "--out"

}  // namespace mbsopt::inline app
