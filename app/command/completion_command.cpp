// Prints completion for bash, from the commands and options that the parser knows.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "app/command/command_table.hpp"
#include "app/terminal/exit_code.hpp"

namespace mbsopt::inline app {
namespace {

// "auto tlm adjoint" of an option that takes one of these words: its type is "TEXT:{auto,tlm,adjoint}".
std::string choices_of(const CLI::Option& option) {
  std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return "";
  type = type.substr(begin + 1, end - begin - 1);
  std::ranges::replace(type, ',', ' ');
  return type;
}

}  // namespace

// Completes commands first. Then it completes a command's options after "-", the words that an option or the command
// takes, or else files.
int completion_command(const CommandContext& context) {
  CLI::App app;
  CommandOptions options;
  add_commands(app, options);
  std::string cases, after;
  for (const CLI::App* sub : app.get_subcommands({})) {
    std::vector<std::string> words;
    std::string takes;
    for (const CLI::Option* option : sub->get_options()) {
      const std::string choices = choices_of(*option);
      if (option->get_positional()) takes = choices;
      for (const std::string& name : option->get_lnames()) {
        words.push_back("--" + name);
        if (!choices.empty()) after += fmt::format("    --{}) takes='{}' ;;\n", name, choices);
      }
    }
    cases += fmt::format("    {}) options='{}' takes='{}' ;;\n", sub->get_name(), fmt::join(words, " "), takes);
  }
  context.out << fmt::format(R"(_mbsopt() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" options takes
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W '{}' -- "$word")
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{}  esac
  case "${{COMP_WORDS[COMP_CWORD - 1]}}" in
{}  esac
  if [[ "$word" == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")
  elif [[ "$takes" ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$takes" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -o filenames -F _mbsopt mbsopt
)",
                             fmt::join(command_names(), " "), cases, after);
  return kDone;
}

}  // namespace mbsopt::inline app
