// All commands: one row each.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/command/command_options.hpp"

namespace mbsopt {

struct Command {
  std::string_view name;
  std::string_view does;
  int (*run)(const CommandContext&);
  AddOptions* add_options;
  std::string_view example;  // the part after "mbsopt NAME"
};
std::span<const Command> commands();
std::vector<std::string> command_names();

// Registers the commands with the parser, with their options.
void add_commands(CLI::App& app, CommandOptions& options);

}  // namespace mbsopt
