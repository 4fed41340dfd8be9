#include <fmt/format.h>

#include "app/report/run_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/case_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/simulated_motion.hpp"
#include "core/simulate/simulation_warnings.hpp"

namespace mbsopt::inline app {
namespace {

void add_objectives(Run& run, const SimulatedMotion& motion) {
  if (motion.psi.size() == 0) return;
  run.result["objectives"] = objectives_json(names_of(run.problem.objectives), motion.psi, motion.true_values);
  add_instants(run, motion);
  add_units(run.result, objective_units(run.problem));
  run.context.out << '\n' << objective_table(run.result).text();
}

}  // namespace

int simulate_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (context.options.sensitivities) require_sensitivities(scene);
  run.start();
  if (!settle_accuracy(run)) return run.finish();
  const SimulatedMotion motion = simulated_motion(run, parameter_values(scene));
  const SimulationResult& simulation = motion.simulation;
  run.warn(motion.warnings);
  if (simulation.status != SimulationStatus::assembly_failed) {
    run.result["model"] = to_json(motion.model);
    run.result["simulation"] = to_json(simulation.statistics);
    print_model(context.out, scene.name, motion.model);
    Scene simulated = scene;
    if (!simulation.ok()) simulated.simulation.end_time = simulation.last_good_time;
    print_simulation(context.out, simulated, simulation.statistics);
    write_trajectory(run, motion.trajectory, simulation.statistics.singular);
    run.warn(simulation_warnings(scene, scene.simulation, simulation.statistics, simulation.ok()));
    warn_of_stiffness(run, simulation.statistics, false);
  }
  if (simulation.ok()) {
    add_objectives(run, motion);
    add_cases(run, false);
    if (context.options.sensitivities) write_sensitivities(run);
  } else if (simulation.status == SimulationStatus::stopped) {
    run.stopped(fmt::format("trajectory.csv holds the motion up to {:.6g} s", simulation.last_good_time));
  } else {
    run.failed(simulation.message, simulation.last_good_time);
  }
  RunPage page(run);
  add_simulated_motion(page, scene, motion, prescribed_points(run.problem, motion.instants));
  page.write();
  return run.finish();
}

}  // namespace mbsopt::inline app
