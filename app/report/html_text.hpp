// Text in HTML, and text in a string of the JSON within a page.
#pragma once

#include <string>
#include <string_view>

namespace mbsopt {

std::string html_escaped(std::string_view text);
std::string html_words(std::string_view text);   // escaped; no line ends within "1e-9" or "--out"
std::string json_quoted(std::string_view text);  // in quotes
// JSON for a script of a page. "<" stands in texts only, and "</script" or "<!--" would change what the browser reads.
std::string without_tags(std::string json);

}  // namespace mbsopt
