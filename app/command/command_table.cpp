#include "app/command/command_table.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>

namespace mbsopt {
namespace {

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
            "problems/pendulum/identify.json --profile J,k"},
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

}  // namespace mbsopt
