// Reading a problem is its whole check; what is left to say is what the mechanism is.
#include "app/command.hpp"
#include "app/run.hpp"
#include "core/dynamics/assembly.hpp"

namespace mbsopt {

int validate_command(const CommandContext& context) {
  Run run(context);
  const Mechanism mechanism(run.problem.scene, parameter_values(run.problem.scene));
  run.start();
  const Assembly assembly(mechanism, run.problem.scene.simulation.start_time);
  if (!assembly.result().ok) return run.failed(assembly.result().message, run.problem.scene.simulation.start_time);
  run.result["model"] = to_json(assembly.summary());
  print_model(context.out, run.problem.scene.name, assembly.summary());
  return run.done();
}

}  // namespace mbsopt
