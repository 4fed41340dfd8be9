#pragma once

#include <string>
#include <string_view>

namespace mbsopt {

std::string sha256_of(std::string_view text);  // lower-case hex

}  // namespace mbsopt
