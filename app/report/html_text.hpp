// Text in HTML, and the JSON within a page: its texts, its arrays of numbers.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mbsopt::inline app {

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

// The arrays of numbers that the script of a page reads, each array once.
//
//   PageArrays arrays;
//   arrays.add({0, 0.5, 1});   // 0
//   arrays.add({0, 0.5, 1});   // 0 again
class PageArrays {
 public:
  // Returns the number of the array. Its values have so many digits, and infinite ones become null.
  std::size_t add(const std::vector<double>& values, int digits = 6);
  std::string text() const;  // JSON: [[...], ...]

 private:
  std::map<std::string, std::size_t> numbers_;
  std::vector<std::string> texts_;
};

}  // namespace mbsopt::inline app
