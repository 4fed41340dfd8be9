// All commands: one row each, with the options that CLI11 writes into CommandOptions.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/run/command.hpp"

namespace CLI {
class App;
}

namespace mbsopt::inline app {

struct Command {
  std::string_view name;
  std::string_view does;
  CommandFunction* run;
  void (*add_options)(CLI::App& sub, CommandOptions& options);
  std::string_view example;  // the part after "mbsopt NAME"
};
std::span<const Command> commands();
std::vector<std::string> command_names();

// Registers the commands with the parser, with their options.
void add_commands(CLI::App& app, CommandOptions& options);

}  // namespace mbsopt::inline app
