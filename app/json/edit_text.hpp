// Changes values in the text of a problem file. Everything else stays, with comments and formatting.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace mbsopt::inline app {

// Returns the text with the value at a path (in the form of --set) replaced by `json`. It adds missing objects on the
// way. Throws InputError if the text is not JSON or the path leads nowhere.
std::string with_value(const std::string& text, std::string_view path, const std::string& json);

// Removes the member at a path of keys; the text stays if there is none.
std::string without_member(const std::string& text, std::string_view path);

// Applies one --set, "path=value". The value is JSON if it can be read as JSON, else a string.
std::string with_override(const std::string& text, const std::string& override_text);

// Replaces the value of each named parameter by a number in SI with 17 significant digits.
std::string with_parameter_values(const std::string& text, const std::map<std::string, double>& values);

}  // namespace mbsopt::inline app
