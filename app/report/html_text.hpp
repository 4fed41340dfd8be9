// Text in HTML, and text in a string of the JSON within a page.
#pragma once

#include <string>
#include <string_view>

namespace mbsopt {

std::string html_escaped(std::string_view text);
std::string html_words(std::string_view text);   // escaped; no line ends within "1e-9" or "--out"
std::string json_quoted(std::string_view text);  // in quotes
// "[1,2]" of items of which text_of makes JSON.
template <class Items, class TextOf>
std::string json_list(const Items& items, const TextOf& text_of) {
  std::string list = "[";
  for (const auto& item : items) list += (list.size() > 1 ? "," : "") + text_of(item);
  return list + "]";
}
// JSON for a script of a page. "<" stands in texts only, and "</script" or "<!--" would change what the browser reads.
std::string without_tags(std::string json);

}  // namespace mbsopt
