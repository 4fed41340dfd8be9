#include <fmt/format.h>

#include "app/command.hpp"
#include "app/interrupt.hpp"
#include "app/objective_values.hpp"
#include "app/optimized_problem.hpp"
#include "app/report/run_report.hpp"
#include "app/run.hpp"
#include "app/simulated_motion.hpp"
#include "app/text_table.hpp"
#include "core/expression/counted.hpp"
#include "optim/design.hpp"

namespace mbsopt {
namespace {

void print_design(std::ostream& out, const DesignResult& design) {
  TextTable parameters({"parameter", "initial", "optimum", "unit", "at bound"});
  for (const DesignVariable& v : design.variables) {
    parameters.add({v.name, significant(v.initial, 10), significant(v.value, 10), v.unit.empty() ? "-" : v.unit,
                    bound_hit(v.at_lower, v.at_upper)});
  }
  std::vector<std::string> header{"objective", "before", "after"};
  if (!design.constraints.empty()) header.insert(header.end(), {"at least", "at most"});
  TextTable objectives(header);
  std::vector<std::string> minimised{design.objective, significant(design.objective_initial),
                                     significant(design.objective_final) + true_extreme_text(design.objective_true)};
  minimised.resize(header.size());
  objectives.add(minimised);
  const auto bound = [](const std::optional<double>& value) { return value ? significant(*value) : std::string(); };
  for (const DesignConstraint& c : design.constraints) {
    objectives.add({c.objective, significant(c.initial), significant(c.value) + true_extreme_text(c.true_value),
                    bound(c.lower), bound(c.upper)});
  }
  out << '\n' << parameters.text() << '\n' << objectives.text();
  out << fmt::format("\n{} {}: {}, {}, {:.3g} s\n", design.optimizer, to_string(design.status),
                     counted(design.iterations, "iteration"), counted(design.evaluations, "evaluation"),
                     design.wall_seconds);
}

void add_to_result(Json& result, const DesignResult& design) {
  result["simulation"] = to_json(design.final_evaluation.statistics);
  result["objectives"][design.objective] = objective_json(design.objective_final, design.objective_true);
  result["objectives"][design.objective]["initial"] = design.objective_initial;
  for (const DesignConstraint& c : design.constraints) {
    result["objectives"][c.objective] = {{"value", c.value},          {"initial", c.initial},
                                         {"lower", or_null(c.lower)}, {"upper", or_null(c.upper)},
                                         {"violation", c.violation},  {"at_bound", bound_json(c.at_lower, c.at_upper)}};
    if (c.true_value) result["objectives"][c.objective]["true_value"] = *c.true_value;
  }
  for (const DesignVariable& v : design.variables) {
    result["parameters"][v.name] = {
        {"initial", v.initial},      {"value", v.value},          {"unit", v.unit},
        {"lower", or_null(v.lower)}, {"upper", or_null(v.upper)}, {"at_bound", bound_json(v.at_lower, v.at_upper)}};
  }
  result["optimizer"] = {{"type", design.optimizer},
                         {"status", to_string(design.status)},
                         {"message", design.message},
                         {"gradients", design.gradient_choice},
                         {"iterations", design.iterations},
                         {"evaluations", design.evaluations},
                         {"failed_evaluations", design.failed_evaluations},
                         {"simulations", design.simulations},
                         {"wall_seconds", design.wall_seconds},
                         {"objective_initial", design.objective_initial},
                         {"objective_final", design.objective_final}};
}

Trajectory history_of(const DesignResult& design) {
  Trajectory history{{"iteration", "objective", "infeasibility", "optimality"}, {}};
  for (const DesignVariable& v : design.variables) history.columns.push_back(v.name);
  for (const DesignRow& row : design.history) {
    history.rows.push_back({static_cast<double>(row.iteration), row.objective, row.violation, row.optimality});
    history.rows.back().insert(history.rows.back().end(), row.parameters.begin(), row.parameters.end());
  }
  return history;
}

DesignResult minimised(Run& run) {
  DesignOptions options;
  options.simulation_progress = [](double) { return !interrupted(); };
  options.progress = [&](const DesignRow& row) {
    run.progress.iteration(fmt::format("iteration {:3d}   objective {:.6e}   infeasibility {:.1e}   optimality {:.1e}",
                                       row.iteration, row.objective, row.violation, row.optimality));
    return !interrupted();
  };
  DesignResult design = run_design(run.problem, options);
  run.progress.finish();
  return design;
}

std::vector<NewValue> new_values(const DesignResult& design) {
  std::vector<NewValue> values;
  for (const DesignVariable& v : design.variables) values.push_back({"", v.name, v.value});
  return values;
}

}  // namespace

int design_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (!run.problem.design) throw std::invalid_argument("design: missing; it says what to minimise and what may change");
  run.start();
  const SimulatedMotion before = simulated_motion(run, parameter_values(scene));
  if (!before.simulation.ok()) {
    interrupted() ? run.stopped("nothing was designed yet")
                  : run.failed(before.simulation.message, before.simulation.last_good_time);
    run.write("report.html", simulation_report(scene, run.result, before.trajectory));
    return run.finish();
  }
  run.result["model"] = to_json(before.model);
  print_model(context.out, scene.name, before.model);

  const DesignResult design = minimised(run);
  add_to_result(run.result, design);
  print_design(context.out, design);
  for (const std::string& warning : design.warnings) run.warn(warning);
  const SimulatedMotion after = interrupted() ? SimulatedMotion{} : simulated_motion(run, design.rho);
  if (design.status == SolverStatus::stopped) {
    run.stopped("optimized.json holds the best design so far");
  } else if (!design.ok()) {
    run.failed(design.message);
  }
  const Trajectory history = history_of(design);
  run.write("optimized.json", optimized_problem_text(run, new_values(design)));
  run.write("history.csv", to_csv(history));
  if (!after.trajectory.rows.empty()) run.write("trajectory.csv", to_csv(after.trajectory));
  run.write("report.html", design_report(scene, design.rho, run.result, history, before.trajectory, after.trajectory));
  return run.finish();
}

}  // namespace mbsopt
