#include "app/command/command_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>

#include "app/command/starter_files.hpp"
#include "core/expression/did_you_mean.hpp"

namespace mbsopt::inline app {
namespace {

void add_run_options(CLI::App& sub, CommandOptions& options) {
  sub.add_option("--threads", options.threads, "at most so many threads or processes (results do not depend on it)")
      ->check(CLI::Range(1, 1024));
  sub.add_flag("--quiet", options.quiet, "no progress on standard error");
  sub.add_flag("--allow-plugins", options.allow_plugins,
               "load the shared libraries that the problem names, which run code of their own");
  sub.add_flag("--json", options.json, "print result.json on standard output, and nothing else there");
}

// One of the words. The description also serves the completion.
CLI::Validator one_of(const std::vector<std::string>& words) {
  const auto find = [words](const std::string& word) {
    if (std::ranges::find(words, word) != words.end()) return std::string();
    return fmt::format("there is no '{}'{}; known: {}", word, did_you_mean(word, words), joined(words));
  };
  return {find, fmt::format("{{{}}}", fmt::join(words, ","))};
}

void add_keep_journal(CLI::App& sub, CommandOptions& options) {
  sub.add_flag("--keep-journal", options.keep_journal, "keep journal.jsonl after a successful run");
}

// Adds the options of every command that reads a problem file.
void problem_options(CLI::App& sub, CommandOptions& options) {
  add_run_options(sub, options);
  sub.add_option("problem", options.problem_file, "problem file (*.json)")->required();
  sub.add_option("--out", options.out, "folder for the results (default: out/<name>/)");
  sub.add_option("--set", options.sets, "change a field: parameters.k1.value=120; may be repeated")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
}

void kinematics_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  sub.add_flag("--mat", options.mat, "also write trajectory.mat: the columns of trajectory.csv as vectors for MATLAB");
}

void simulate_options(CLI::App& sub, CommandOptions& options) {
  kinematics_options(sub, options);
  sub.add_flag("--sensitivities", options.sensitivities,
               "also write sensitivities.csv: the derivative of each sensor in each parameter over time");
}

void linearise_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  sub.add_option("--at", options.at, "time at which the simulated state is linearised (default: the initial state)")
      ->type_name("TIME");
  sub.add_option("--inputs", options.inputs, "parameters u of B and D: forces, stiffnesses, masses")
      ->delimiter(',')
      ->type_name("NAME,...");
  sub.add_option("--outputs", options.outputs, "sensors of C and D (default: all)")
      ->delimiter(',')
      ->type_name("NAME,...");
}

void gradient_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  sub.add_option("--method", options.method, "how gradients are computed")
      ->check(one_of({"auto", "tlm", "adjoint", "cvodes_forward", "cvodes_adjoint", "fd"}))
      ->capture_default_str();
  sub.add_flag("--hessian", options.hessian,
               "second derivatives, too: extrapolated differences of the adjoint gradient (of the tlm gradient with "
               "--method tlm) on frozen steps, not forward over adjoint; not for integrators of CVODES");
}

void design_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  sub.add_flag("--explain", options.explain, "say which searches were made and why, and how each ended");
  add_keep_journal(sub, options);
}

void identify_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  sub.add_flag("--preflight", options.preflight, "say what the data hold and would determine, and fit nothing");
  sub.add_option("--recover", options.recover, "known-truth recovery: number of simulated records to fit")
      ->check(CLI::Range(2, 1'000'000));
  add_keep_journal(sub, options);
}

void tradeoff_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  sub.add_option("--budget", options.budget,
                 "seconds for the sweep, roughly; 0: only the file's own settings and the defaults")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  sub.add_option("--apply", options.apply,
                 "also write recommended.json, the problem with the fastest settings of this accuracy: 1e-6")
      ->check(CLI::Range(1e-15, 1.0))
      ->type_name("ACCURACY");
}

void sweep_options(CLI::App& sub, CommandOptions& options) {
  problem_options(sub, options);
  SweepOptions& sweep = options.sweep;
  sub.add_option("--vary", sweep.vary, "a parameter and its values: k1=10:20:5, or k1=10:20 with --samples; repeated")
      ->type_name("NAME=LOW:HIGH[:COUNT]")
      ->allow_extra_args(false);
  sub.add_option("--samples", sweep.samples, "number of points of a Latin hypercube, instead of the grid")
      ->check(CLI::Range(1, 10'000'000));
  sub.add_option("--seed", sweep.seed, "of the samples; drawn and kept in result.json otherwise");
  sub.add_option("--points", sweep.points, "a CSV file with a column per parameter, a row per point")
      ->type_name("FILE");
  sub.add_flag("--gradients", sweep.gradients, "derivatives in the varied parameters, too");
  add_keep_journal(sub, options);
}

void resume_options(CLI::App& sub, CommandOptions& options) {
  add_run_options(sub, options);
  sub.add_option("folder", options.problem_file, "output folder of the run, with its journal.jsonl")->required();
}

void new_options(CLI::App& sub, CommandOptions& options) {
  std::vector<std::string> kinds;
  for (const Starter& starter : starters()) kinds.emplace_back(starter.kind);
  sub.add_option("kind", options.starter, "kind of task")->required()->check(one_of(kinds));
  sub.add_option("--out", options.out, "folder for the file (default: the current one)");
}

void import_options(CLI::App& sub, CommandOptions& options) {
  sub.add_option("model", options.problem_file, "model file: URDF (<robot>) or MJCF (<mujoco>)")->required();
  sub.add_option("--out", options.out, "folder for the file (default: the current one)");
}

void no_options(CLI::App&, CommandOptions&) {}

constexpr std::array kCommands{
    Command{"validate", "check a problem file; print bodies, equations, degrees of freedom", validate_command,
            problem_options, "problems/five_bar/design.json"},
    Command{"simulate", "forward dynamics", simulate_command, simulate_options,
            "problems/quarter_car/ride.json --set parameters.k.value=25000"},
    Command{"kinematics", "positions, velocities, accelerations of a fully driven mechanism, and driving forces",
            kinematics_command, kinematics_options, "problems/four_bar/kinematics.json"},
    Command{"linearise", "eigenvalues, modes and A, B, C, D of the motion beside the initial state", linearise_command,
            linearise_options, "problems/quarter_car/ride.json"},
    Command{"gradient", "objectives and their gradients", gradient_command, gradient_options,
            "problems/five_bar/sensitivities.json --method adjoint"},
    Command{"check", "all gradient methods against each other and against differences", check_command, problem_options,
            "problems/five_bar/sensitivities.json"},
    Command{"design", "optimal design", design_command, design_options,
            "problems/five_bar/design.json --out out/first_try"},
    Command{"identify", "fit parameters to measurements", identify_command, identify_options,
            "problems/pendulum/identify.json --recover 20"},
    Command{"tradeoff", "error against cost for integrators, tolerances, formulations and gradient methods",
            tradeoff_command, tradeoff_options, "problems/five_bar/design.json --budget 20"},
    Command{"sweep", "objectives over a grid, samples or a list of parameter values", sweep_command, sweep_options,
            "problems/five_bar/design.json --vary L01=1.8:2.4:7"},
    Command{"resume", "continue a design, an identification or a sweep that was interrupted or killed", resume_command,
            resume_options, "out/five_bar"},
    Command{"new", "write a commented starter file into the current folder", new_command, new_options, "four-bar"},
    Command{"import", "write a URDF or MJCF model as a problem file into the current folder", import_command,
            import_options, "examples/models/arm.urdf"},
    Command{"completion", "print completion for bash", completion_command, no_options,
            "> ~/.local/share/bash-completion/completions/mbsopt"},
    Command{"schema", "print the JSON Schema of problem files", schema_command, no_options, "> problem.schema.json"},
};

}  // namespace

std::span<const Command> commands() { return kCommands; }

std::vector<std::string> command_names() {
  std::vector<std::string> names;
  for (const Command& command : kCommands) names.emplace_back(command.name);
  return names;
}

void add_commands(CLI::App& app, CommandOptions& options) {
  app.require_subcommand(1);
  for (const Command& command : kCommands) {
    CLI::App* const sub = app.add_subcommand(std::string(command.name), std::string(command.does));
    sub->footer(fmt::format("Example:\n  mbsopt {} {}", command.name, command.example));
    command.add_options(*sub, options);
  }
}

}  // namespace mbsopt::inline app
