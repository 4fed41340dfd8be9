// JSON text (comments allowed) to nodes with positions. nlohmann's parser decides what is JSON; a scan of the tokens
// beside it says where each one begins, which that parser forgets.
#pragma once

#include "app/json/findings.hpp"
#include "app/json/node.hpp"

namespace mbsopt {

// Reads the text of `findings`. Syntax errors, duplicate keys and the like are added there; throws InputError where
// nothing can be read.
Node parse_json(Findings& findings);

// A value from a command line: JSON where it is JSON, else a string. No positions.
Node parse_override_value(const std::string& text, int source);

}  // namespace mbsopt
