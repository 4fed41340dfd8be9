#pragma once

#include <string>
#include <string_view>

namespace mbsopt::inline app {

std::string sha256_of(std::string_view text);  // lower-case hex

}  // namespace mbsopt::inline app
