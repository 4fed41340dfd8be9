// JSON as text. This file alone compiles nlohmann's parser and writer, which cost each source several seconds.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace mbsopt {

using Json = nlohmann::ordered_json;

Json read_json(std::string_view text);               // throws Json::parse_error
Json read_json_or_discarded(std::string_view text);  // is_discarded() where the text is not JSON

// indent is the number of spaces per level; -1 writes one line. U+FFFD replaces invalid UTF-8, so check file names
// before.
std::string json_text(const Json& json, int indent = -1);

}  // namespace mbsopt
