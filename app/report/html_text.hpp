// Text as HTML shows it.
#pragma once

#include <string>
#include <string_view>

namespace mbsopt {

std::string html_escaped(std::string_view text);

}  // namespace mbsopt
