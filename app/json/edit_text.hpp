// Changes values in the text of a problem file and leaves everything else as it was written, comments and formatting.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace mbsopt {

// The text with the value at a path (as --set takes it) replaced by `json`; objects on the way that are missing are
// added. Throws InputError where the text is not JSON or the path leads nowhere.
std::string with_value(const std::string& text, std::string_view path, const std::string& json);

// Without the member at a path of keys; as it is where there is none.
std::string without_member(const std::string& text, std::string_view path);

// With one --set, "path=value", applied: the value is JSON where it is JSON, else a string.
std::string with_override(const std::string& text, const std::string& override_text);

// With the value of each named parameter replaced by a number in SI of 17 significant digits.
std::string with_parameter_values(const std::string& text, const std::map<std::string, double>& values);

}  // namespace mbsopt
