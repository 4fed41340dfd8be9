// The options of each command for CLI11, which writes them into CommandOptions.
#pragma once

#include "app/run/command.hpp"

namespace CLI {
class App;
}

namespace mbsopt {

using AddOptions = void(CLI::App& sub, CommandOptions& options);

AddOptions problem_options;  // of every command that reads a problem file
AddOptions simulate_options, kinematics_options, linearise_options, gradient_options;
AddOptions design_options, identify_options, tradeoff_options, sweep_options, resume_options;
AddOptions new_options, import_options, no_options;

}  // namespace mbsopt
