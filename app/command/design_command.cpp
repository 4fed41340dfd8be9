#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/optimized_problem.hpp"
#include "app/results/simulated_motion.hpp"
#include "app/run/command.hpp"
#include "app/run/run.hpp"
#include "app/starts/design_starts.hpp"
#include "app/starts/multistart.hpp"
#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"
#include "core/start/assembly.hpp"
#include "core/start/model_warnings.hpp"

namespace mbsopt::inline app {
namespace {

void print_design(std::ostream& out, const DesignResult& design, const ObjectiveUnits& units,
                  const std::string& effort) {
  TextTable parameters({"parameter", "initial", end_of_search(to_string(design.status)), "unit", "at bound"});
  for (const DesignVariable& v : design.variables) {
    parameters.add({v.name, significant(v.initial, 10), significant(v.value, 10), v.unit.empty() ? "-" : v.unit,
                    bound_hit(v.at_lower, v.at_upper)});
  }
  TextTable objectives({"objective", "unit", "before", "after", "true extreme", "at least", "at most", "price"});
  const auto add = [&](const std::string& name, const std::string& objective, const auto& of,
                       const std::vector<std::string>& limits) {
    std::vector<std::string> cells{name, shown_unit(units, objective), significant(of.initial), significant(of.value),
                                   or_blank(of.true_value)};
    cells.insert(cells.end(), limits.begin(), limits.end());
    objectives.add(std::move(cells));
  };
  add(design.objective, design.objective,
      DesignCase{"", 1, design.objective_initial, design.objective_final, design.objective_true}, {});
  for (const DesignCase& c : design.cases)
    add(fmt::format("{} ({})", design.objective, c.name), design.objective, c, {});
  for (const DesignConstraint& c : design.constraints)
    add(c.in_words(), c.objective, c, {or_blank(c.lower), or_blank(c.upper), c.price != 0 ? significant(c.price) : ""});
  std::vector<std::string> unless_empty{"true extreme"};
  if (design.constraints.empty()) unless_empty.insert(unless_empty.end(), {"at least", "at most", "price"});
  out << '\n' << parameters.text() << '\n' << objectives.text(unless_empty);
  out << fmt::format("\n{} {}: {}, {}, {}{}\n", design.optimizer, to_string(design.status),
                     counted(design.iterations, "iteration"), counted(design.evaluations, "evaluation"), effort,
                     design.seed ? fmt::format(", seed {}", *design.seed) : "");
  if (std::isfinite(design.optimality))
    out << fmt::format(
        "optimality {:.1e}, infeasibility {:.1e} at the solution{}\n", design.optimality, design.violation,
        design.true_violation > design.violation ? fmt::format(", {:.1e} of true extremes", design.true_violation)
                                                 : "");
  if (std::any_of(design.constraints.begin(), design.constraints.end(),
                  [](const DesignConstraint& c) { return c.price != 0; }))
    out << fmt::format("price: decrease of '{}' per unit by which the limit is relaxed\n", design.objective);
  if (design.limit_rounds > 0)
    out << fmt::format("{} to make limits hold for true extremes\n", counted(design.limit_rounds, "further round"));
  if (design.conflicts.empty()) return;
  TextTable conflicts({"limit in conflict", "missed by", "price"});
  for (const DesignConflict& c : design.conflicts)
    conflicts.add({c.limit, c.missed > 0 ? significant(c.missed) : "", significant(c.price)});
  out << '\n'
      << conflicts.text()
      << "price: decrease of the sum of relative violations per unit by which the limit is relaxed\n";
}

void add_to_result(Json& result, const DesignResult& design) {
  result["simulation"] = to_json(design.final_evaluation.statistics);
  result["objectives"][design.objective] = objective_json(design.objective_final, design.objective_true);
  result["objectives"][design.objective]["initial"] = design.objective_initial;
  for (const DesignCase& c : design.cases) {
    Json& objective = result["cases"][c.name]["objectives"][design.objective];
    objective = objective_json(c.value, c.true_value);
    objective["initial"] = c.initial, objective["weight"] = c.weight;
  }
  for (const DesignConstraint& c : design.constraints) {
    Json& objectives = c.load_case.empty() ? result["objectives"] : result["cases"][c.load_case]["objectives"];
    objectives[c.objective] = {{"value", c.value},
                               {"initial", c.initial},
                               {"lower", or_null(c.lower)},
                               {"upper", or_null(c.upper)},
                               {"violation", c.violation},
                               {"price", c.price},
                               {"at_bound", bound_json(c.at_lower, c.at_upper)}};
    if (!c.true_value) continue;
    objectives[c.objective]["true_value"] = *c.true_value;
    objectives[c.objective]["true_violation"] = c.true_violation;
  }
  for (const DesignVariable& v : design.variables) {
    result["parameters"][v.name] = {
        {"initial", v.initial},      {"value", v.value},          {"unit", v.unit},
        {"lower", or_null(v.lower)}, {"upper", or_null(v.upper)}, {"at_bound", bound_json(v.at_lower, v.at_upper)}};
  }
  result["optimizer"] = {{"type", design.optimizer},
                         {"algorithm", design.algorithm},
                         {"status", to_string(design.status)},
                         {"message", design.message},
                         {"gradients", design.gradient_choice},
                         {"iterations", design.iterations},
                         {"evaluations", design.evaluations},
                         {"failed_evaluations", design.failed_evaluations},
                         {"simulations", design.simulations},
                         {"wall_seconds", design.wall_seconds},
                         {"objective_initial", design.objective_initial},
                         {"objective_final", design.objective_final},
                         {"optimality", design.optimality},
                         {"infeasibility", design.violation},
                         {"true_infeasibility", design.true_violation}};
  if (design.seed) result["optimizer"]["seed"] = *design.seed;
  if (design.status == SolverStatus::converged)
    result["optimizer"]["optimum"] = design.is_at_boundary() ? "boundary" : "interior";
  if (design.mode) result["optimizer"]["assembly_mode"] = mode_json(*design.mode);
  if (design.closing_steps > 0) result["optimizer"]["closing_steps"] = design.closing_steps;
  if (design.limit_rounds > 0) result["optimizer"]["limit_rounds"] = design.limit_rounds;
  for (const DesignConflict& c : design.conflicts)
    result["conflicts"].push_back({{"limit", c.limit}, {"missed", c.missed}, {"price", c.price}});
}

// The bound of an extreme as a line in the plot of what it is taken of.
std::vector<PlotLimit> limits_of(const ObjectiveBound& bound, Extreme extreme, const std::string& before = "") {
  if (extreme == Extreme::maximum && bound.upper) return {{before + "at most", *bound.upper, true}};
  if (extreme == Extreme::minimum && bound.lower) return {{before + "at least", *bound.lower, false}};
  return {};
}

// Limits that bound the extreme of a sensor bound the sensor at all times.
SensorLimits sensor_limits(const Problem& problem) {
  SensorLimits limits;
  for (const ObjectiveBound& bound : problem.design->subject_to) {
    const auto spec = std::ranges::find(problem.objectives, bound.objective, &ObjectiveSpec::name);
    if (spec == problem.objectives.end()) continue;
    for (std::size_t k = 0; k < std::size(kMeanKinds); ++k) {
      if (!spec->means[k]) continue;
      for (const PlotLimit& limit : limits_of(bound, kMeanKinds[k].extreme, bound.objective + ", "))
        limits.push_back({spec->means[k]->text(), limit});
    }
  }
  return limits;
}

// The running terms of all objectives, except those that the plot of a sensor already shows.
std::vector<RunningTerm> running_terms(const Problem& problem, const ObjectiveUnits& units) {
  std::vector<RunningTerm> terms;
  for (const ObjectiveSpec& spec : problem.objectives) {
    const std::string unit = shown_unit(units, spec.name);
    RunningTerm term{spec.name, "Integrand of " + spec.name, fmt::format("integrand [{}]", unit_per(unit, "s"))};
    bool is_sensor = false;
    for (std::size_t k = 0; k < std::size(kMeanKinds); ++k) {
      if (!spec.means[k]) continue;
      const std::string text = spec.means[k]->text();
      is_sensor = std::ranges::find(problem.scene.sensors, text, &Sensor::name) != problem.scene.sensors.end();
      term.title = fmt::format("{}: {} this over time", spec.name, kMeanKinds[k].name);
      term.y_label = fmt::format("{} [{}]", text, unit);
      const auto bound = std::ranges::find(problem.design->subject_to, spec.name, &ObjectiveBound::objective);
      if (bound != problem.design->subject_to.end()) term.limits = limits_of(*bound, kMeanKinds[k].extreme);
    }
    if (!is_sensor) terms.push_back(std::move(term));
  }
  return terms;
}

// Omits columns that the method does not have.
Trajectory history_of(const DesignResult& design) {
  const bool optimality = std::all_of(design.history.begin(), design.history.end(),
                                      [](const DesignRow& row) { return std::isfinite(row.optimality); });
  Trajectory history{{"iteration", "objective", "infeasibility"}, {}};
  if (optimality) history.columns.push_back("optimality");
  for (const DesignVariable& v : design.variables) history.columns.push_back(v.name);
  for (const DesignRow& row : design.history) {
    std::vector<double>& line = history.rows.emplace_back(
        std::vector<double>{static_cast<double>(row.iteration), row.objective, row.violation});
    if (optimality) line.push_back(row.optimality);
    line.insert(line.end(), row.parameters.begin(), row.parameters.end());
  }
  return history;
}

// If the linkage does not close at the values of the file, the design starts from values at which it does.
void lead_to_closing(Run& run, SimulatedMotion& before) {
  DesignOptions options;
  options.simulation_progress = run.watched("closing the linkage");
  const std::optional<Problem> closing = problem_that_closes(run.problem, options);
  if (!closing) return;
  const Eigen::VectorXd rho = parameter_values(closing->scene);
  SimulatedMotion motion = simulated_motion(run, rho);
  if (!motion.simulation.ok()) return;
  std::string start;
  for (const std::string& name : run.problem.design->variables) {
    const auto p = std::ranges::find(closing->scene.parameters, name, &Parameter::name);
    start += fmt::format("{}{} = {}", start.empty() ? "" : ", ", name, significant(p->value));
  }
  run.warn(
      fmt::format("the linkage does not close at the values of the file ({}): the design starts at {}, where it does",
                  before.simulation.message, start));
  run.start_from(closing->scene.parameters);
  before = std::move(motion);
}

}  // namespace

int design_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (!run.problem.design) throw std::invalid_argument("design: missing; it says what to minimise and what may change");
  run.start();
  if (!settle_accuracy(run)) return run.finish();
  SimulatedMotion before = simulated_motion(run, parameter_values(scene));
  if (!before.simulation.ok() && !interrupted()) lead_to_closing(run, before);
  if (!before.simulation.ok()) {
    run.broke_off("nothing was designed yet", before.simulation.message, before.simulation.last_good_time);
    run.write("report.html",
              simulation_report(scene, run.result, before.trajectory,
                                {.targets = prescribed_points(run.problem, before.instants), .forces = before.forces}));
    return run.finish();
  }
  run.result["model"] = to_json(before.model);
  print_model(context.out, scene.name, before.model);
  const Mechanism mechanism(scene, parameter_values(scene));  // with derivatives, which the warnings look at
  run.warn(model_warnings(mechanism, Assembly(mechanism, scene.simulation.start_time)));

  LongRun long_run(run);
  const auto [design, cut_off] = minimised(long_run, before.psi);
  add_to_result(run.result, design);
  const ObjectiveUnits units = objective_units(run.problem);
  add_units(run.result, units);
  const std::optional<MultistartSpec>& starts = run.problem.design->multistart;
  print_design(
      context.out, design, units,
      starts ? effort(run, design.simulations, design.wall_seconds) : fmt::format("{:.3g} s", design.wall_seconds));
  run.warn(design.warnings);
  run.warn(design.final_evaluation.warnings);
  warn_of_stiffness(run, design.final_evaluation.statistics, true);
  const bool other_poses = design.mode && !design.mode->bodies.empty();
  if (other_poses) run.take_poses(design.mode->bodies);
  const SimulatedMotion after = interrupted() ? SimulatedMotion{} : simulated_motion(run, design.rho);
  if (cut_off || design.status == SolverStatus::stopped || interrupted()) {
    long_run.stopped("optimized.json holds the best design so far");
  } else if (!design.ok()) {
    long_run.failed(design.status, design.message);
  }
  for (std::size_t i = 0; i < after.instants.size(); ++i) {
    const std::string& name = run.problem.objectives[i].name;
    if (!after.instants[i].empty() && run.result["objectives"].contains(name))
      run.result["objectives"][name]["instants"] = after.instants[i];
  }
  const Trajectory history = history_of(design);
  std::vector<NewValue> values;
  for (const DesignVariable& v : design.variables) values.push_back({"", v.name, v.value});
  run.write("optimized.json",
            optimized_problem_text(run, values, design.mode ? design.mode->bodies : std::vector<Body>{}));
  run.write("history.csv", to_csv(history));
  if (!after.trajectory.rows.empty()) write_trajectory(run, after.trajectory, after.simulation.statistics.singular);
  run.write("report.html",
            design_report(scene, design.rho, run.result, history, {before.trajectory, before.forces, before.running},
                          {after.trajectory, after.forces, after.running}, sensor_limits(run.problem),
                          running_terms(run.problem, units), prescribed_points(run.problem, after.instants)));
  return long_run.finish();
}

}  // namespace mbsopt::inline app
