// A text and its lines: finds the place of an offset in an editor.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace mbsopt::inline app {

inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

struct Position {
  int line = 1, column = 1;  // columns in characters (code points)
};

class SourceText {
 public:
  explicit SourceText(std::string content);
  const std::string& content() const { return content_; }
  Position position(std::size_t offset) const;

  // The offset of the first byte that is not UTF-8, or npos.
  std::size_t first_invalid_byte() const;

  // Offset in the text of byte `at` of the value of the string literal that begins at `literal`.
  std::size_t inside_string(std::size_t literal, std::size_t at) const;

 private:
  std::size_t continuations(std::size_t end) const;  // bytes before `end` that begin no character

  std::string content_;
  std::vector<std::size_t> line_starts_;
  std::vector<std::size_t> continuations_;  // up to every kStride bytes
};

// Returns the whole file. Throws InputError with the given name if it cannot be read.
std::string read_text_file(const std::filesystem::path& file);

}  // namespace mbsopt::inline app
