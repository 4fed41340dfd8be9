// Reading a problem is its whole check; what is left to say is what the mechanism is.
#include "app/command.hpp"
#include "app/run.hpp"

namespace mbsopt {

int validate_command(const CommandContext& context) {
  Run run(context);
  const Mechanism mechanism(run.problem.scene, parameter_values(run.problem.scene));
  run.start();
  assembled(run, mechanism);
  return run.finish();
}

}  // namespace mbsopt
