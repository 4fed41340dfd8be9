// JSON paths name a place in a scene: keys joined by dots, indices in brackets, as in bodies[2].points.tip. A key that
// is not a plain identifier stands in quotes, with a backslash before quotes and backslashes: bodies[2].points["left
// tip"].
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mbsopt {

std::string child_path(const std::string& parent, std::string_view key);
std::string child_path(const std::string& parent, std::size_t index);

}  // namespace mbsopt
