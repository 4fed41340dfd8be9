// mbsopt COMMAND problem.json [--out DIR] [--set path=value]... [--quiet] [--json] [--threads N]
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

struct CommandOptions;
struct Ranks;

// Reads options from the words after the program's name. Throws std::invalid_argument if they make no sense.
CommandOptions options_of(const std::vector<std::string>& arguments);

// Runs one command in this process and returns its exit code. arguments exclude the program's name. ranks are those
// that may help (not owned).
int run_command_line(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err,
                     bool err_is_terminal = false, Ranks* ranks = nullptr, const NamedTerms& terms = {});

}  // namespace mbsopt::inline app
