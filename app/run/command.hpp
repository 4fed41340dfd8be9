// The input of every command, and the commands. Each returns an exit code (exit_code.hpp). Bad input is an exception
// (InputError, SceneError, OutputError), which command_line.cpp turns into words and exit code 2. A failed output
// (WriteError) gives exit code 1.
#pragma once

#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/run/sweep_points.hpp"
#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

struct ProblemSource;
struct Ranks;

struct CommandOptions {
  std::string problem_file;
  std::string starter;               // of new: its kind
  std::string out;                   // --out; empty: out/<name>/
  std::vector<std::string> sets;     // --set, each "path=value"
  std::string method = "auto";       // --method of gradient
  bool hessian = false;              // --hessian of gradient
  bool preflight = false;            // --preflight of identify: no fit
  int recover = 0;                   // --recover of identify: fits of simulated records
  double budget = 60;                // --budget of tradeoff [s]
  std::optional<double> apply;       // --apply of tradeoff: the accuracy wanted
  std::optional<double> at;          // --at of linearise [s]
  std::vector<std::string> inputs;   // --inputs of linearise: parameters
  std::vector<std::string> outputs;  // --outputs of linearise: sensors; empty: all
  SweepOptions sweep;                // --vary, --samples, --seed, --points, --gradients of sweep
  bool mat = false;                  // --mat of simulate and kinematics: trajectory.mat
  bool sensitivities = false;        // --sensitivities of simulate: sensitivities.csv
  int threads = 0;                   // --threads, also worker processes; 0: as many as the machine has
  bool quiet = false;                // --quiet
  bool allow_plugins = false;        // --allow-plugins
  bool json = false;                 // --json: only result.json on standard output
  bool explain = false;              // --explain of design: which searches were made and why
  bool keep_journal = false;         // --keep-journal of design, identify and sweep
  bool resume = false;               // continue with the journal in `out`
};

struct CommandContext {
  std::string command;
  std::vector<std::string> arguments;  // as typed, for the provenance
  CommandOptions options;
  std::ostream& out;             // results as text; with --json they are left out
  std::ostream& err;             // progress and errors
  bool err_is_terminal = false;  // a bar may be drawn
  std::ostream* json = nullptr;  // the stream for result.json with --json
  NamedTerms terms = {};         // in C++, which the problem may call by name: those of the program
  Ranks* ranks = nullptr;        // other processes that compute for this one, under mpirun
  mutable std::shared_ptr<const ProblemSource> source = nullptr;  // once Run has read the problem
};

using CommandFunction = int(const CommandContext& context);  // returns the exit code
CommandFunction validate_command, simulate_command, kinematics_command, linearise_command, gradient_command;
CommandFunction check_command, design_command, identify_command, tradeoff_command, sweep_command;
CommandFunction resume_command;  // options.problem_file: the folder
CommandFunction import_command;  // options.problem_file: the model
CommandFunction new_command, schema_command, completion_command;

}  // namespace mbsopt::inline app
