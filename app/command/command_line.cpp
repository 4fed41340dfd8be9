#include "app/command/command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <stdexcept>

#include "app/command/starter_files.hpp"
#include "app/files/atomic_file.hpp"
#include "app/json/input_error.hpp"
#include "app/json/problem_source.hpp"
#include "app/report/run_index.hpp"
#include "app/run/command.hpp"
#include "app/run/provenance.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/mechanism/mechanism.hpp"
#include "optim/problem/csv_table.hpp"

namespace mbsopt {
namespace {

struct Command {
  const char* name;
  const char* does;
  int (*run)(const CommandContext&);
  const char* example;  // what follows "mbsopt NAME"
};
int completion_command(const CommandContext& context);

constexpr std::array kCommands{
    Command{"validate", "check a problem file; print bodies, equations, degrees of freedom", validate_command,
            "problems/five_bar/design.json"},
    Command{"simulate", "forward dynamics", simulate_command,
            "problems/quarter_car/ride.json --set parameters.k.value=25000"},
    Command{"kinematics", "positions, velocities, accelerations of a fully driven mechanism, and driving forces",
            kinematics_command, "problems/four_bar/kinematics.json"},
    Command{"linearise", "eigenvalues, modes and A, B, C, D of the motion beside the initial state", linearise_command,
            "problems/quarter_car/ride.json"},
    Command{"gradient", "objectives and their gradients", gradient_command,
            "problems/five_bar/sensitivities.json --method adjoint"},
    Command{"check", "all gradient methods against each other and against differences", check_command,
            "problems/five_bar/sensitivities.json"},
    Command{"design", "optimal design", design_command, "problems/five_bar/design.json --out out/first_try"},
    Command{"identify", "fit parameters to measurements", identify_command,
            "problems/pendulum/identify.json --profile J,k"},
    Command{"tradeoff", "error against cost for integrators, tolerances, formulations and gradient methods",
            tradeoff_command, "problems/five_bar/design.json --budget 20"},
    Command{"sweep", "objectives over a grid, samples or a list of parameter values", sweep_command,
            "problems/five_bar/design.json --vary L01=1.8:2.4:7"},
    Command{"resume", "go on with a design, an identification or a sweep that was interrupted or killed",
            resume_command, "out/five_bar"},
    Command{"new", "write a commented starter file into the current folder", new_command, "four-bar"},
    Command{"import", "write a URDF or MJCF model as a problem file into the current folder", import_command,
            "examples/models/arm.urdf"},
    Command{"completion", "print completion for bash", completion_command,
            "> ~/.local/share/bash-completion/completions/mbsopt"},
    Command{"schema", "print the JSON Schema of problem files", schema_command, "> problem.schema.json"},
};

std::vector<std::string> command_names() {
  std::vector<std::string> names;
  for (const Command& command : kCommands) names.emplace_back(command.name);
  return names;
}

bool is_known(const std::string& word) {
  const std::vector<std::string> names = command_names();
  return word.starts_with('-') || std::find(names.begin(), names.end(), word) != names.end();
}

std::string what_is_wrong_with(const std::string& word) {
  return fmt::format("there is no command '{}'{}", word, did_you_mean(word, command_names()));
}

// "help" is --help, "help design" is design --help.
std::vector<std::string> without_help_command(std::vector<std::string> arguments) {
  if (arguments.empty() || arguments[0] != "help") return arguments;
  arguments.erase(arguments.begin());
  arguments.push_back("--help");
  return arguments;
}

void add_options(CLI::App& sub, const std::string& name, CommandOptions& options) {
  if (name == "schema" || name == "completion") return;
  if (name == "new") {
    std::vector<std::string> kinds;
    for (const Starter& starter : starters()) kinds.emplace_back(starter.kind);
    sub.add_option("kind", options.starter, "kind of task")->required()->check(CLI::IsMember(kinds));
    sub.add_option("--out", options.out, "folder for the file (default: the current one)");
    return;
  }
  if (name == "import") {
    sub.add_option("model", options.problem_file, "model file: URDF (<robot>) or MJCF (<mujoco>)")->required();
    sub.add_option("--out", options.out, "folder for the file (default: the current one)");
    return;
  }
  sub.add_option("--threads", options.threads, "at most so many threads or processes (results do not depend on it)")
      ->check(CLI::Range(1, 1024));
  sub.add_flag("--quiet", options.quiet, "no progress on standard error");
  sub.add_flag("--allow-plugins", options.allow_plugins,
               "load the shared libraries that the problem names, which run code of their own");
  sub.add_flag("--json", options.json, "print result.json on standard output, and nothing else there");
  if (name == "resume") {
    sub.add_option("folder", options.problem_file, "output folder of the run, with its journal.jsonl")->required();
    return;
  }
  sub.add_option("problem", options.problem_file, "problem file (*.json)")->required();
  sub.add_option("--out", options.out, "folder for the results (default: out/<name>/)");
  sub.add_option("--set", options.sets, "change a field: parameters.k1.value=120; may be repeated")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
  if (name == "simulate" || name == "kinematics") {
    sub.add_flag("--mat", options.mat,
                 "also write trajectory.mat: the columns of trajectory.csv as vectors for MATLAB");
    sub.add_flag("--gnuplot", options.gnuplot, "also write trajectory.gp, a gnuplot script that plots trajectory.csv");
  }
  if (name == "simulate") {
    sub.add_flag("--sensitivities", options.sensitivities,
                 "also write sensitivities.csv: the derivative of each sensor in each parameter over time");
  }
  if (name == "linearise") {
    sub.add_option("--at", options.at, "the state that the simulation reaches then, instead of the initial one")
        ->type_name("TIME");
    sub.add_option("--inputs", options.inputs, "parameters u of B and D: forces, stiffnesses, masses")
        ->delimiter(',')
        ->type_name("NAME,...");
    sub.add_option("--outputs", options.outputs, "sensors of C and D (default: all)")
        ->delimiter(',')
        ->type_name("NAME,...");
  }
  if (name == "identify") {
    sub.add_option("--profile", options.profiles, "profile likelihood of fitted parameters: k1,run1.theta0")
        ->delimiter(',')
        ->type_name("NAME,...");
    sub.add_flag("--preflight", options.preflight, "say what the data hold and would determine, and fit nothing");
    sub.add_option("--recover", options.recover, "known-truth recovery: fits of so many simulated records")
        ->check(CLI::Range(2, 1'000'000));
    sub.add_option("--bootstrap", options.bootstrap, "intervals by fits of so many records with resampled residuals")
        ->check(CLI::Range(2, 1'000'000));
    sub.add_option("--compare", options.compare, "another problem file: which model explains the data better")
        ->type_name("FILE.json");
  }
  if (name == "tradeoff") {
    sub.add_option("--budget", options.budget,
                   "seconds for the sweep, roughly; 0: only the file's own settings and the defaults")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str();
    sub.add_option("--alpha", options.alpha, "instead of the sweep, what alpha does to the penalty form: 1e2:1e16")
        ->type_name("LOW:HIGH");
    sub.add_option("--apply", options.apply,
                   "also write recommended.json, the problem with the fastest settings of this accuracy: 1e-6")
        ->check(CLI::Range(1e-15, 1.0))
        ->type_name("ACCURACY");
  }
  if (name == "sweep") {
    SweepOptions& sweep = options.sweep;
    sub.add_option("--vary", sweep.vary, "a parameter and its values: k1=10:20:5, or k1=10:20 with --samples; repeated")
        ->type_name("NAME=LOW:HIGH[:COUNT]")
        ->allow_extra_args(false);
    sub.add_option("--samples", sweep.samples, "a Latin hypercube of so many points instead of the grid")
        ->check(CLI::Range(1, 10'000'000));
    sub.add_option("--seed", sweep.seed, "of the samples; drawn and kept in result.json otherwise");
    sub.add_option("--points", sweep.points, "a CSV file with a column per parameter, a row per point")
        ->type_name("FILE");
    sub.add_flag("--gradients", sweep.gradients, "derivatives in the varied parameters, too");
  }
  if (name == "design" || name == "identify" || name == "sweep")
    sub.add_flag("--keep-journal", options.keep_journal, "keep journal.jsonl when the run has come to a good end");
  if (name == "gradient") {
    sub.add_option("--method", options.method, "how gradients are computed")
        ->check(CLI::IsMember({"auto", "tlm", "adjoint", "cvodes_forward", "cvodes_adjoint", "fd"}))
        ->capture_default_str();
    sub.add_flag("--hessian", options.hessian,
                 "second derivatives, too: extrapolated differences of the adjoint gradient (of the tlm gradient with "
                 "--method tlm) on frozen steps, not forward over adjoint; not for integrators of CVODES");
  }
}

std::string about_the_problem(const CommandContext& context, const std::string& words) {
  const std::string& file = context.options.problem_file;
  const std::optional<std::string> placed = context.source ? context.source->placed(words) : std::nullopt;
  return placed.value_or(file + ": " + words);
}

// The command's exit code; what was wrong with the input goes to `err` in words.
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

// index.html of the folder `out` that holds the run's folder; folders elsewhere are the user's own.
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

void add_commands(CLI::App& app, CommandOptions& options) {
  app.require_subcommand(1);
  for (const Command& command : kCommands) {
    CLI::App* const sub = app.add_subcommand(command.name, command.does);
    sub->footer(fmt::format("Example:\n  mbsopt {} {}", command.name, command.example));
    add_options(*sub, command.name, options);
  }
}

// "auto tlm adjoint" of an option that takes one of these words: its type is "TEXT:{auto,tlm,adjoint}".
std::string choices_of(const CLI::Option& option) {
  std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return "";
  type = type.substr(begin + 1, end - begin - 1);
  std::ranges::replace(type, ',', ' ');
  return type;
}

// Commands first; then a command's options where a word begins with "-", the words that an option or the command takes,
// else files.
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
  if (!arguments.empty() && !is_known(arguments[0])) {
    err << fmt::format("mbsopt: {}; available: {}\n", what_is_wrong_with(arguments[0]), joined(command_names()));
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
  const auto command =
      std::find_if(kCommands.begin(), kCommands.end(), [&](const Command& c) { return context.command == c.name; });
  const int exit_code = run_in_words(*command, context);
  if (exit_code != kBadInput) update_index(context);
  return flushed(exit_code, out, err);
}

}  // namespace mbsopt
