// Turns JSON text (comments allowed) into nodes with positions. nlohmann's parser decides what is JSON. It does not
// keep positions, so a scan of the tokens finds where each one begins.
#pragma once

#include "app/json/findings.hpp"
#include "app/json/node.hpp"

namespace mbsopt {

// Reads the text of `findings`, and adds syntax errors, duplicate keys and the like to it. Throws InputError if nothing
// can be read.
Node parse_json(Findings& findings);

// A value from a command line without positions: JSON if it can be read as JSON, else a string.
Node parse_override_value(const std::string& text, int source);

}  // namespace mbsopt
