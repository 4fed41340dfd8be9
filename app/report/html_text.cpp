#include "app/report/html_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "app/files/json_text.hpp"

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

std::string json_quoted(std::string_view text) { return without_tags(json_text(text)); }

std::string without_tags(std::string json) {
  for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;) json.replace(at, 1, "\\u003c");
  return json;
}

std::size_t PageArrays::add(const std::vector<double>& values, int digits) {
  const std::string text = json_list(values, [&](double value) {
    return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : std::string("null");
  });
  const auto [at, is_new] = numbers_.emplace(text, texts_.size());
  if (is_new) texts_.push_back(at->first);
  return at->second;
}

std::string PageArrays::text() const { return fmt::format("[{}]", fmt::join(texts_, ",\n")); }

}  // namespace mbsopt::inline app
