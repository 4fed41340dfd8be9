// All fuzz targets share these checks. A target is a function of some bytes: libFuzzer calls it with bytes that it
// mutates (./dev fuzz), replay.cpp with the files of tests/fuzz/corpus. A broken expectation aborts; both report that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace mbsopt::fuzz {

[[noreturn]] inline void fail(std::string_view what, std::string_view about) {
  std::fprintf(stderr, "fuzz: %.*s:\n%.*s\n", static_cast<int>(what.size()), what.data(),
               static_cast<int>(about.size()), about.data());
  std::abort();
}

inline void expect(bool good, std::string_view what, std::string_view about) {
  if (!good) fail(what, about);
}

// A refusal speaks to an engineer: it is not empty, and it holds no text of a library, unless it quotes the input.
inline void expect_words(std::string_view message, std::string_view input) {
  expect(!message.empty(), "a refusal without words", message);
  for (const std::string_view raw : {"json.exception", "basic_string", "vector::", "std::", "Eigen::", "bad_alloc"})
    expect(message.find(raw) == std::string_view::npos || input.find(raw) != std::string_view::npos,
           "a refusal in a library's words", message);
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace mbsopt::fuzz
