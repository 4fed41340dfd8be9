#include "app/report/html_text.hpp"

#include <algorithm>

#include "app/files/json_text.hpp"

namespace mbsopt {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string html_words(std::string_view text) {
  std::string words;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text[begin] == ' ' ? begin + 1 : std::min(text.find(' ', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const std::size_t exponent = word.find("e-");
    const bool number = exponent != std::string_view::npos && exponent > 0 && is_digit(word[exponent - 1]);
    const std::string escaped = html_escaped(word);
    words +=
        number || (word.starts_with('-') && word.size() > 1) ? "<span class=\"whole\">" + escaped + "</span>" : escaped;
    begin = end;
  }
  return words;
}

std::string json_quoted(std::string_view text) { return without_tags(json_text(text)); }

std::string without_tags(std::string json) {
  for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;) json.replace(at, 1, "\\u003c");
  return json;
}

}  // namespace mbsopt
