#include "app/report/html_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace mbsopt::inline app {

std::string html_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const std::size_t special = std::string_view("&<>\"").find(c);
    escaped +=
        special == std::string_view::npos ? std::string(1, c) : std::array{"&amp;", "&lt;", "&gt;", "&quot;"}[special];
  }
  return escaped;
}

std::string html_words(std::string_view text) {
  std::string words;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text[begin] == ' ' ? begin + 1 : std::min(text.find(' ', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const std::size_t exponent = word.find("e-");
    const bool number = exponent != std::string_view::npos && exponent > 0 &&
                        std::isdigit(static_cast<unsigned char>(word[exponent - 1]));
    const std::string escaped = html_escaped(word);
    words +=
        number || (word.starts_with('-') && word.size() > 1) ? "<span class=\"whole\">" + escaped + "</span>" : escaped;
    begin = end;
  }
  return words;
}

}  // namespace mbsopt::inline app
