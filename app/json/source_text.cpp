#include "app/json/source_text.hpp"

#include <algorithm>
#include <cstdlib>

#include "app/json/input_error.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline app {

namespace {

constexpr std::size_t kLargestFile = std::size_t{256} << 20;  // no problem file is larger

constexpr std::size_t kStride = 1024;  // a line may be the whole file: columns are counted from the nearest multiple

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& message) {
  constexpr std::size_t kShown = 200;
  std::string name = file.string();
  if (name.size() > kShown) name.replace(kShown, std::string::npos, "...");
  throw InputError({{name.empty() ? "''" : name, 0, 0, "", message}});
}

}  // namespace

SourceText::SourceText(std::string content) : content_(std::move(content)), line_starts_{0} {
  for (std::size_t i = 0; i < content_.size(); ++i)
    if (content_[i] == '\n') line_starts_.push_back(i + 1);
  std::size_t count = 0;
  for (std::size_t i = 0; i < content_.size(); ++i) {
    if (i % kStride == 0) continuations_.push_back(count);
    count += is_continuation(content_[i]) ? 1 : 0;
  }
}

std::size_t SourceText::continuations(std::size_t end) const {
  if (end == 0) return 0;
  const std::size_t stride = (end - 1) / kStride;
  std::size_t count = continuations_[stride];
  for (std::size_t i = stride * kStride; i < end; ++i) count += is_continuation(content_[i]) ? 1 : 0;
  return count;
}

Position SourceText::position(std::size_t offset) const {
  offset = std::min(offset, content_.size());
  const auto line = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset) - 1;
  std::size_t start = *line;
  if (start == 0 && content_.starts_with(kByteOrderMark)) start = std::min(kByteOrderMark.size(), offset);
  const std::size_t characters = offset - start - (continuations(offset) - continuations(start));
  return {static_cast<int>(line - line_starts_.begin()) + 1, static_cast<int>(characters) + 1};
}

// Overlong forms, surrogates and code points beyond U+10FFFF are invalid.
std::size_t SourceText::first_invalid_byte() const {
  constexpr unsigned kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // code point of a sequence of so many bytes
  for (std::size_t at = 0, length = 1; at < content_.size(); at += length) {
    const unsigned first = static_cast<unsigned char>(content_[at]);
    length = first < 0x80 ? 1 : first < 0xC0 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF8 ? 4 : 0;
    if (length == 1) continue;
    if (length == 0 || at + length > content_.size()) return at;
    unsigned code = first & (0x7Fu >> length);
    for (std::size_t i = 1; i < length; ++i) {
      const char c = content_[at + i];
      if (!is_continuation(c)) return at;
      code = code << 6 | (static_cast<unsigned char>(c) & 0x3Fu);
    }
    if (code < kLeast[length] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return at;
  }
  return std::string::npos;
}

std::size_t SourceText::inside_string(std::size_t literal, std::size_t at) const {
  std::size_t i = literal + 1;  // after the quote
  for (std::size_t value = 0; i < content_.size() && content_[i] != '"' && value < at;) {
    if (content_[i] != '\\') {
      ++i;
      ++value;
      continue;
    }
    if (content_.compare(i, 2, "\\u") != 0) {
      i += 2;
      ++value;
      continue;
    }
    const unsigned long unit = std::strtoul(content_.substr(i + 2, 4).c_str(), nullptr, 16);
    const bool pair = unit >= 0xD800 && unit <= 0xDBFF;
    i += pair ? 12 : 6;
    value += pair ? 4 : (unit < 0x80 ? 1 : (unit < 0x800 ? 2 : 3));
  }
  return i;
}

std::string read_text_file(const std::filesystem::path& file) {
  try {
    return content_of_regular_file(file, kLargestFile);
  } catch (const FileError& error) {
    fail(file, error.what());
  }
}

}  // namespace mbsopt::inline app
