#include "app/json/source_text.hpp"

#include <algorithm>
#include <cstdlib>

#include "app/json/input_error.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline app {

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kLargestFile = std::size_t{256} << 20;  // no problem file is larger

constexpr std::size_t kStride = 1024;  // a line may be the whole file: columns are counted from the nearest multiple

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

// The bytes of the UTF-8 sequence at `at`, or 0 if it is invalid (overlong forms, surrogates and beyond U+10FFFF are).
std::size_t sequence_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned b0 = byte(at), b1 = byte(at + 1);
  const auto continues = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i)
      if ((byte(at + i) & 0xC0u) != 0x80u) return false;
    return true;
  };
  if (b0 < 0x80) return 1;
  if (b0 >= 0xC2 && b0 <= 0xDF) return continues(1, 2) ? 2 : 0;
  if (b0 >= 0xE0 && b0 <= 0xEF) {
    const bool overlong = b0 == 0xE0 && b1 < 0xA0, surrogate = b0 == 0xED && b1 > 0x9F;
    return continues(1, 3) && !overlong && !surrogate ? 3 : 0;
  }
  if (b0 >= 0xF0 && b0 <= 0xF4) {
    const bool overlong = b0 == 0xF0 && b1 < 0x90, beyond = b0 == 0xF4 && b1 > 0x8F;
    return continues(1, 4) && !overlong && !beyond ? 4 : 0;
  }
  return 0;
}

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

std::size_t SourceText::first_invalid_byte() const {
  for (std::size_t at = 0; at < content_.size();) {
    const std::size_t length = sequence_length(content_, at);
    if (length == 0) return at;
    at += length;
  }
  return std::string::npos;
}

std::size_t SourceText::inside_string(std::size_t literal, std::size_t at) const {
  std::size_t i = literal + 1;  // after the quote
  for (std::size_t value = 0; i < content_.size() && content_[i] != '"' && value < at;) {
    if (content_[i] != '\\') {
      ++i, ++value;
      continue;
    }
    if (content_.compare(i, 2, "\\u") != 0) {
      i += 2, ++value;
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
