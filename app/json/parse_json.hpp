// Turns JSON text (comments allowed) into nodes with positions. nlohmann's parser keeps no positions, so it reads
// single strings, numbers and literals only.
#pragma once

#include "app/json/findings.hpp"
#include "app/json/node.hpp"

namespace mbsopt::inline app {

// Reads the text of `findings`, and adds syntax errors, duplicate keys and the like to it. Throws InputError if nothing
// can be read.
Node parse_json(Findings& findings);

// A value from a command line without positions: JSON if it can be read as JSON, else a string.
Node parse_override_value(const std::string& text, int source);

}  // namespace mbsopt::inline app
