#include "app/command/command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <stdexcept>

#include "app/command/command_table.hpp"
#include "app/files/atomic_file.hpp"
#include "app/json/input_error.hpp"
#include "app/json/problem_source.hpp"
#include "app/report/run_index.hpp"
#include "app/run/provenance.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/mechanism/mechanism.hpp"
#include "optim/problem/csv_table.hpp"

namespace mbsopt::inline app {
namespace {

// "help" is --help, "help design" is design --help.
std::vector<std::string> without_help_command(std::vector<std::string> arguments) {
  if (arguments.empty() || arguments[0] != "help") return arguments;
  arguments.erase(arguments.begin());
  arguments.push_back("--help");
  return arguments;
}

std::string about_the_problem(const CommandContext& context, const std::string& words) {
  const std::string& file = context.options.problem_file;
  const std::optional<std::string> placed = context.source ? context.source->placed(words) : std::nullopt;
  return placed.value_or(file + ": " + words);
}

// Returns the command's exit code. Faults of the input go to `err` in words.
int run_in_words(const Command& command, const CommandContext& context) {
  try {
    return command.run(context);
  } catch (const InputError& error) {
    context.err << error.what() << '\n';
  } catch (const SceneError& error) {
    context.err << about_the_problem(context, error.what()) << '\n';
  } catch (const CsvError& error) {
    context.err << error.what() << '\n';
  } catch (const std::invalid_argument& error) {
    context.err << about_the_problem(context, error.what()) << '\n';
  } catch (const WriteError& error) {
    context.err << error.what() << '\n';
    return kNumericalFailure;
  } catch (const OutputError& error) {
    context.err << error.what() << '\n';
  } catch (const std::filesystem::filesystem_error& error) {
    context.err << error.what() << '\n';
  } catch (const std::bad_alloc&) {
    context.err << "mbsopt: out of memory\n";
    return kNumericalFailure;
  } catch (const std::exception& e) {
    context.err << "mbsopt: " << e.what() << '\n';
    return kNumericalFailure;
  }
  return kBadInput;
}

// Updates index.html of the folder `out` that holds the run's folder. Folders elsewhere are the user's own.
void update_index(const CommandContext& context) {
  if (context.source == nullptr && context.command != "resume") return;  // no problem was run
  std::filesystem::path run = context.command == "resume" ? context.options.problem_file : context.options.out;
  if (run.empty()) run = std::filesystem::path("out") / "run";
  if (!run.has_filename()) run = run.parent_path();  // out/run/
  if (run.parent_path().filename() != "out") return;
  try {
    write_run_index(run.parent_path());
  } catch (const std::exception& error) {
    context.err << "warning: " << error.what() << '\n';
  }
}

// Printed text may wait in a buffer, so only a flush shows whether it arrived.
int flushed(int exit_code, std::ostream& out, std::ostream& err) {
  errno = 0;
  if (out.flush()) return exit_code;
  err << fmt::format("mbsopt: standard output cannot be written{}{}\n", errno ? ": " : "",
                     errno ? std::strerror(errno) : "");
  return exit_code == kDone ? kNumericalFailure : exit_code;
}

// "--outt" of `mbsopt simulate --outt x`, or the words that no option takes.
std::string what_is_not_expected(const CLI::App& app) {
  const CLI::App& command = *app.get_subcommands().front();
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  const std::vector<std::string> words = app.remaining(true);
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with('-'); });
  if (option == words.end())
    return fmt::format("{}: nothing takes '{}'; mbsopt help {} lists what it takes", command.get_name(),
                       fmt::join(words, " "), command.get_name());
  const std::string name = option->substr(0, option->find('='));
  return fmt::format("{}: there is no option '{}'{}; known: {}", command.get_name(), name, did_you_mean(name, known),
                     joined(known));
}

void parse(CLI::App& app, const std::vector<std::string>& arguments) {
  app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 takes them last first
}

}  // namespace

CommandOptions options_of(const std::vector<std::string>& arguments) {
  CLI::App app("", "mbsopt");
  CommandOptions options;
  add_commands(app, options);
  try {
    parse(app, arguments);
  } catch (const CLI::ParseError& error) {
    throw std::invalid_argument(fmt::format("'{}' is no command line: {}", fmt::join(arguments, " "), error.what()));
  }
  return options;
}

int run_command_line(const std::vector<std::string>& given, std::ostream& out, std::ostream& err, bool err_is_terminal,
                     Ranks* ranks, const NamedTerms& terms) {
  const InterruptGuard guard;
  const std::vector<std::string> arguments = without_help_command(given);
  const std::vector<std::string> names = command_names();
  if (!arguments.empty() && !arguments[0].starts_with('-') && std::ranges::find(names, arguments[0]) == names.end()) {
    err << fmt::format("mbsopt: there is no command '{}'{}; available: {}\n", arguments[0],
                       did_you_mean(arguments[0], names), joined(names));
    return kBadInput;
  }
  CLI::App app("Optimal design and parameter identification of mechanisms.", "mbsopt");
  app.set_version_flag("--version", "mbsopt " + program_version());
  app.footer(
      "mbsopt help COMMAND, or mbsopt COMMAND --help, lists a command's options.\n"
      "Example:\n  mbsopt new four-bar\n  mbsopt design four-bar.json\nThen open out/four_bar/report.html.");
  app.failure_message(CLI::FailureMessage::simple);
  CommandOptions options;
  add_commands(app, options);
  if (arguments.empty()) {
    err << app.help();
    return kBadInput;
  }
  try {
    parse(app, arguments);
  } catch (const CLI::ExtrasError&) {
    err << fmt::format("mbsopt {}\n", what_is_not_expected(app));
    return kBadInput;
  } catch (const CLI::ParseError& error) {
    return flushed(app.exit(error, out, err) == 0 ? kDone : kBadInput, out, err);
  }
  std::ostream nowhere(nullptr);
  const CommandContext context{.command = app.get_subcommands().front()->get_name(),
                               .arguments = arguments,
                               .options = options,
                               .out = options.json ? nowhere : out,
                               .err = err,
                               .err_is_terminal = err_is_terminal,
                               .json = options.json ? &out : nullptr,
                               .terms = terms,
                               .ranks = ranks};
  const int exit_code = run_in_words(*std::ranges::find(commands(), context.command, &Command::name), context);
  if (exit_code != kBadInput) update_index(context);
  return flushed(exit_code, out, err);
}

}  // namespace mbsopt::inline app
