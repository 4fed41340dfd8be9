// Doubles as text without loss of a bit: base64 (RFC 4648, section 4) of their bytes, the lowest first. Each takes
// eleven characters; decimals take about twenty.
//
//   std::vector<double> same = doubles_of(base64_of({1.5, -2}));
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mbsopt {

std::string base64_of(std::span<const double> values);
// Throws std::invalid_argument if the text is not of this form.
std::vector<double> doubles_of(std::string_view base64);

}  // namespace mbsopt
