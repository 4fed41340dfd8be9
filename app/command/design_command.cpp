// Optimises the problem. Its result goes to result.json, and with tables and plots to the terminal and the report.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "app/report/run_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/optimized_problem.hpp"
#include "app/results/simulated_motion.hpp"
#include "app/starts/design_starts.hpp"
#include "app/starts/multistart.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "core/start/assembly.hpp"
#include "core/start/model_warnings.hpp"
#include "optim/objective/followed_mode.hpp"

namespace mbsopt::inline app {
namespace {

void add_to_result(Json& result, const DesignResult& design) {
  result["simulation"] = to_json(design.final_evaluation.statistics);
  result["objectives"][design.objective] = objective_json(design.objective_final, design.objective_true);
  result["objectives"][design.objective]["initial"] = design.objective_initial;
  const auto add = [](Json& objective, const DesignCase& c) {
    objective = objective_json(c.value, c.true_value);
    objective["initial"] = c.initial;
    objective["weight"] = c.weight;
  };
  for (const DesignCase& c : design.cases) add(result["cases"][c.name]["objectives"][design.objective], c);
  for (const DesignCase& term : design.terms) add(result["objectives"][term.name], term);
  for (const DesignConstraint& c : design.constraints) {
    Json& objectives = c.load_case.empty() ? result["objectives"] : result["cases"][c.load_case]["objectives"];
    Json& objective = objectives[c.objective];
    objective = {{"value", c.value},
                 {"initial", c.initial},
                 {"lower", or_null(c.lower)},
                 {"upper", or_null(c.upper)},
                 {"violation", c.violation},
                 {"price", c.price},
                 {"at_bound", bound_json(c.at_lower, c.at_upper)}};
    if (c.true_value) {
      objective["true_value"] = *c.true_value;
      objective["true_violation"] = c.true_violation;
    }
  }
  for (const DesignVariable& v : design.variables)
    result["parameters"][v.name] = {
        {"initial", v.initial},      {"value", v.value},          {"unit", v.unit},
        {"lower", or_null(v.lower)}, {"upper", or_null(v.upper)}, {"at_bound", bound_json(v.at_lower, v.at_upper)}};
  Json& optimizer = result["optimizer"];
  optimizer = {{"type", design.optimizer},
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
  if (design.seed) optimizer["seed"] = *design.seed;
  add_kind_of_end(optimizer, design);
  optimizer["decisions"] = design.decisions;
  for (const DesignConflict& c : design.conflicts)
    result["conflicts"].push_back({{"limit", c.limit}, {"missed", c.missed}, {"price", c.price}});
}

// "track fell from 12.3 to 0.45 m^2 s (-96 %) in 12 iterations; no limit is missed; k is at a bound."
void add_verdict(RunPage& page, const DesignResult& design) {
  const Json& objectives = page.run.result.at("objectives");
  const double before = design.objective_initial, after = design.objective_final;
  std::string words = fmt::format("{} {} from {:.5g} to {:.5g}{}", design.objective,
                                  after < before   ? "fell"
                                  : after > before ? "rose"
                                                   : "stayed",
                                  before, after, after_number(objectives.at(design.objective)));
  if (before != 0) words += fmt::format(" ({:+.3g} %)", 100 * (after - before) / std::abs(before));
  words += " in " + counted(design.iterations, "iteration");
  if (objectives.size() > 1)
    words += fmt::format("; the largest relative violation of a limit is {}", significant(design.true_violation, 2));
  const auto at_bounds =
      std::ranges::count_if(design.variables, [](const DesignVariable& v) { return v.at_lower || v.at_upper; });
  page.verdict(fmt::format("{}; {} of {} at a bound.", words, at_bounds, counted(design.variables.size(), "variable")));
}

// The parameters at both ends of the search; the page has their bounds, too.
void add_parameters(RunPage& page, const DesignResult& design) {
  const Json& parameters = page.run.result.at("parameters");
  const char* const end = end_of_search(to_string(design.status));
  std::vector<TableColumn> columns{
      {"parameter"}, {"initial", "initial", 10}, {end, "value", 10}, {"unit", "unit"}, {"at bound", "at_bound"}};
  page.print(table_of(parameters, columns));
  columns.insert(columns.begin() + 4, {{"lower", "lower"}, {"upper", "upper"}});
  page.table(table_of(parameters, columns));
}

// effort is the text of effort() in multistart.hpp, or the seconds.
void show_design(RunPage& page, const DesignResult& design, const std::string& effort) {
  std::ostream& out = page.run.context.out;
  const Json& result = page.run.result;
  const std::string counts = counted(design.iterations, "iteration") + ", " + counted(design.evaluations, "evaluation");
  add_verdict(page, design);
  page.heading("Result");
  page.paragraph(fmt::format("{}: {}; {}.", design.optimizer, design.message, counts));
  add_parameters(page, design);
  page.both(table_of(objective_rows(result), {{"objective"},
                                              {"unit", "unit"},
                                              {"before", "initial"},
                                              {"after", "value"},
                                              {"true extreme", "true_value", 7, true},
                                              {"at least", "lower", 7, true},
                                              {"at most", "upper", 7, true},
                                              {"margin", "margin", 3, true},
                                              {"price", "price", 7, true}}));
  out << fmt::format("\n{} {}: {}, {}{}\n", design.optimizer, to_string(design.status), counts, effort,
                     design.seed ? fmt::format(", seed {}", *design.seed) : "");
  if (std::isfinite(design.optimality))
    out << fmt::format(
        "optimality {:.1e}, infeasibility {:.1e} at the solution{}\n", design.optimality, design.violation,
        design.true_violation > design.violation ? fmt::format(", {:.1e} of true extremes", design.true_violation)
                                                 : "");
  if (std::ranges::any_of(design.constraints, [](const DesignConstraint& c) { return c.price != 0; }))
    page.say(fmt::format("price: {} of '{}' per unit by which the limit is relaxed",
                         design.maximises ? "increase" : "decrease", design.objective));
  if (design.conflicts.empty()) return;
  page.both(
      table_of(result.at("conflicts"), {{"limit in conflict", "limit"}, {"missed by", "missed"}, {"price", "price"}}));
  page.say("price: decrease of the sum of relative violations per unit by which the limit is relaxed");
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
void add_running_terms(RunPage& page, const ObjectiveUnits& units, const SimulatedMotion& before,
                       const SimulatedMotion& after) {
  const Problem& problem = page.run.problem;
  std::vector<LinePlot> plots;
  for (const ObjectiveSpec& spec : problem.objectives) {
    const std::string unit = shown_unit(units, spec.name);
    LinePlot plot{.title = "Integrand of " + spec.name,
                  .x_label = "t [s]",
                  .y_label = fmt::format("integrand [{}]", unit_per(unit, "s"))};
    bool is_sensor = false;
    for (std::size_t k = 0; k < std::size(kMeanKinds); ++k) {
      if (!spec.means[k]) continue;
      const std::string text = spec.means[k]->text();
      is_sensor = std::ranges::find(problem.scene.sensors, text, &Sensor::name) != problem.scene.sensors.end();
      plot.title = fmt::format("{}: {} this over time", spec.name, kMeanKinds[k].name);
      plot.y_label = fmt::format("{} [{}]", text, unit);
      const auto bound = std::ranges::find(problem.design->subject_to, spec.name, &ObjectiveBound::objective);
      if (bound != problem.design->subject_to.end()) plot.limits = limits_of(*bound, kMeanKinds[k].extreme);
    }
    for (const SimulatedMotion* motion : {&before, &after}) {
      const bool is_first = motion == &before;
      std::optional<PlotSeries> series = series_of(motion->running, spec.name, is_first ? Mark::dashed : Mark::line);
      if (!series) continue;
      series->name = is_first ? "before" : "after";
      plot.series.push_back(*std::move(series));
    }
    if (!is_sensor && std::ranges::any_of(plot.series, [](const PlotSeries& s) { return std::isfinite(s.y.front()); }))
      plots.push_back(std::move(plot));
  }
  if (plots.empty()) return;
  page.heading("Objectives over time");
  for (const LinePlot& plot : plots) page.plot(plot);
}

// Omits columns that the method does not have.
Trajectory history_of(const DesignResult& design) {
  const bool optimality = std::ranges::all_of(
      design.history, [](double found) { return std::isfinite(found); }, &DesignRow::optimality);
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

// Modes are numbered at the values of a file. Returns the new numbers of those that have another one at these values.
std::map<std::string, int> renumbered_modes(Run& run, const Eigen::VectorXd& rho) {
  std::map<std::string, int> modes;
  std::string changes;
  for (const ObjectiveSpec& spec : run.problem.objectives) {
    if (!spec.eigenvalue || spec.eigenvalue->value.starts_with("least")) continue;
    const int before = spec.eigenvalue->mode.value_or(1);
    try {
      const int after = FollowedMode(run.problem.scene, *spec.eigenvalue).number(rho, {});
      if (after == before) continue;
      modes[spec.name] = after;
      changes += fmt::format("{}that of '{}' from {} to {}", changes.empty() ? "" : ", ", spec.name, before, after);
    } catch (const std::runtime_error&) {  // the result says that there is no such mode
    }
  }
  if (!modes.empty())
    run.warn(
        fmt::format("modes change their numbers from slow to fast at the solution, also in optimized.json: {}. To "
                    "limit whichever mode is lowest, take least_frequency or least_damping",
                    changes));
  return modes;
}

void add_motions(RunPage& page, const Scene& designed, const SimulatedMotion& before, const SimulatedMotion& after) {
  const Scene& scene = page.run.problem.scene;
  const std::vector<PointTarget> targets = prescribed_points(page.run.problem, after.instants);
  page.heading("Motion before and after");
  if (!after.trajectory.rows.empty())
    add_motion(page, {{"before", scene, before.trajectory, true},
                      {"after", designed, after.trajectory, false, targets, after.forces}});
  else
    add_motion(page, {{"before", scene, before.trajectory, false, targets, before.forces}});
  add_compared_motions(page, scene, before.trajectory, after.trajectory, sensor_limits(page.run.problem));
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
  RunPage page(run);
  SimulatedMotion before = simulated_motion(run, parameter_values(scene));
  if (!before.simulation.ok() && !interrupted()) lead_to_closing(run, before);
  if (!before.simulation.ok()) {
    run.broke_off("nothing was designed yet", before.simulation.message, before.simulation.last_good_time);
    add_simulated_motion(page, scene, before, prescribed_points(run.problem, before.instants));
    page.write();
    return run.finish();
  }
  run.result["model"] = to_json(before.model);
  print_model(context.out, scene.name, before.model);
  const Mechanism mechanism(scene, parameter_values(scene));  // with derivatives, which the warnings look at
  run.warn(model_warnings(mechanism, Assembly(mechanism, scene.simulation.start_time)));

  LongRun long_run(run);
  const auto [design, cut_off] = minimised(long_run);
  add_to_result(run.result, design);
  const ObjectiveUnits units = objective_units(run.problem);
  add_units(run.result, units);
  show_design(page, design,
              run.problem.design->multistart ? effort(run, design.simulations, design.wall_seconds)
                                             : fmt::format("{:.3g} s", design.wall_seconds));
  if (context.options.explain) {
    context.out << "\ndecisions:\n";
    if (design.gradient_choice != to_string(GradientMethod::automatic))
      context.out << fmt::format("- gradients by {}\n", design.gradient_choice);
    for (const std::string& decision : design.decisions) context.out << fmt::format("- {}\n", decision);
  }
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
  if (design.final_evaluation.ok && !after.simulation.ok() && after.simulation.status != SimulationStatus::stopped &&
      !interrupted())
    run.warn(fmt::format("the motion of this design ends at t = {:.6g} s, after all that its objectives read: {}",
                         after.simulation.last_good_time, after.simulation.message));
  add_instants(run, after);
  const Trajectory history = history_of(design);
  std::vector<NewValue> values;
  for (const DesignVariable& v : design.variables) values.push_back({"", v.name, v.value});
  run.write("optimized.json",
            optimized_problem_text(run, values, design.mode ? design.mode->bodies : std::vector<Body>{},
                                   renumbered_modes(run, design.rho)));
  run.write("history.csv", to_csv(history));
  if (!after.trajectory.rows.empty()) write_trajectory(run, after.trajectory, after.simulation.statistics.singular);
  add_convergence(page, history, unit_of(run.result["objectives"][design.objective]));
  add_multistart(page);
  add_motions(page, with_values(scene, design.rho), before, after);
  add_running_terms(page, units, before, after);
  page.write();
  return long_run.finish();
}

}  // namespace mbsopt::inline app
