// JSON as text. nlohmann's parser and writer are compiled here once: each source that uses them takes seconds longer.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace mbsopt {

using Json = nlohmann::ordered_json;

Json read_json(std::string_view text);               // throws Json::parse_error
Json read_json_or_discarded(std::string_view text);  // is_discarded() where the text is not JSON

// indent: spaces per level; -1: all on one line. U+FFFD replaces what is not UTF-8, so check names of files before.
std::string json_text(const Json& json, int indent = -1);

}  // namespace mbsopt
