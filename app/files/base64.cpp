#include "app/files/base64.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>

namespace mbsopt {
namespace {

static_assert(std::endian::native == std::endian::little && sizeof(double) == 8);

constexpr std::size_t kMostAtOnce = 3 << 20;  // bytes, whole groups of three: OpenSSL counts by int

}  // namespace

std::string base64_of(std::span<const double> values) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
  const std::size_t size = values.size_bytes();
  std::string text((size + 2) / 3 * 4 + 1, '\0');  // OpenSSL ends it with a zero
  for (std::size_t at = 0; at < size; at += kMostAtOnce)
    EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()) + at / 3 * 4, bytes + at,
                    static_cast<int>(std::min(size - at, kMostAtOnce)));
  text.pop_back();
  return text;
}

std::vector<double> doubles_of(std::string_view base64) {
  const auto refuse = [] { throw std::invalid_argument("no numbers in base64"); };
  // OpenSSL would ignore blanks around a block.
  if (base64.size() % 4 != 0 || base64.find_first_of(" \t\r\n-") != std::string_view::npos) refuse();
  const std::size_t padding = base64.ends_with("==") ? 2 : base64.ends_with('=') ? 1 : 0;
  const std::size_t size = base64.size() / 4 * 3 - padding;
  if (size % sizeof(double) != 0 || base64.find('=') < base64.size() - padding) refuse();
  std::string bytes(base64.size() / 4 * 3, '\0');
  constexpr std::size_t kMostCharacters = kMostAtOnce / 3 * 4;
  for (std::size_t at = 0; at < base64.size(); at += kMostCharacters) {
    const std::size_t characters = std::min(base64.size() - at, kMostCharacters);
    const int decoded =
        EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()) + at / 4 * 3,
                        reinterpret_cast<const unsigned char*>(base64.data()) + at, static_cast<int>(characters));
    if (decoded != static_cast<int>(characters / 4 * 3)) refuse();
  }
  std::vector<double> values(size / sizeof(double));
  if (size > 0) std::memcpy(values.data(), bytes.data(), size);
  return values;
}

}  // namespace mbsopt
