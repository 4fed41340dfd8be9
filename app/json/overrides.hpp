// --set path=value: changes a value of a problem file before it is read, and creates the objects on the way to it.
#pragma once

#include <string>

#include "app/json/findings.hpp"
#include "app/json/node.hpp"

namespace mbsopt::inline app {

// override_text is "parameters.k1.value=120". number counts the --set options from 1.
void apply_override(Node& root, const std::string& override_text, int number, Findings& findings);

}  // namespace mbsopt::inline app
