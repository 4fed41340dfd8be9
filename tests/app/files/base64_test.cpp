#include "app/files/base64.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace mbsopt {

TEST_CASE("base64 holds doubles bit by bit, of any number", "[journal]") {
  using Limits = std::numeric_limits<double>;
  const std::vector<double> values{0, -0.0, 1.0 / 3, Limits::denorm_min(), Limits::max(), Limits::infinity(), -2e-300};
  for (std::size_t n = 0; n <= values.size(); ++n) {
    const std::vector<double> few(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n));
    const std::vector<double> read = doubles_of(base64_of(few));
    REQUIRE(read.size() == n);
    for (std::size_t i = 0; i < n; ++i)
      CHECK(std::bit_cast<std::uint64_t>(read[i]) == std::bit_cast<std::uint64_t>(few[i]));
  }
  const std::vector<double> many(500'000, 0.1);  // more than one block
  CHECK(doubles_of(base64_of(many)) == many);
  CHECK(base64_of(std::vector{1.0}) == "AAAAAAAA8D8=");
}

TEST_CASE("base64: text that holds no whole doubles is refused", "[journal]") {
  for (const char* text :
       {"AAAA", "AAAAAAAA8D8", "AAAAAAAA8D=8", "AAAA AAA8D8=", "AAAAAAAA8D8*", "====", "AAAAAAAA8D8-"})
    CHECK_THROWS_AS(doubles_of(text), std::invalid_argument);
}

}  // namespace mbsopt
