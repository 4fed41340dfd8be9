#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "app/report/identification_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/case_results.hpp"
#include "app/results/channel_data.hpp"
#include "app/results/identification_results.hpp"
#include "app/results/optimized_problem.hpp"
#include "app/results/recorded_motion.hpp"
#include "app/results/trajectory_csv.hpp"
#include "app/run/command.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/starts/multistart.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "core/integrate/model_choice.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "core/start/assembly.hpp"
#include "core/start/model_warnings.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/recovery.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/fit/windows.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline app {
namespace {

void set_units(IdentificationResult& fit, const Problem& problem, const std::vector<CsvTable>& data) {
  for (std::size_t e = 0; e < fit.experiments.size(); ++e)
    for (std::size_t c = 0; c < fit.experiments[e].channels.size(); ++c)
      fit.experiments[e].channels[c].unit =
          unit_of_channel(problem.scene, problem.identification->experiments[e].channels[c], data[e]);
}

// An experiment ends with its data, not with the scene's time.
std::function<bool(double t)> fit_progress(Run& run) {
  return [&run](double t) {
    run.progress.time("simulating", t);
    return !interrupted();
  };
}

IdentificationOptions simulating(Run& run) {
  IdentificationOptions options;
  options.threads = case_threads(run);
  options.simulation_progress = fit_progress(run);
  return options;
}

// given is the problem of the file, cut into windows.
IdentificationResult fitted(LongRun& long_run, const Problem& problem, const std::vector<CsvTable>& data,
                            const Problem& given) {
  Run& run = long_run.run;
  IdentificationOptions options = simulating(run);
  options.remembers = true;
  options.progress = [&](const FitRow& row) {
    run.progress.iteration(fmt::format("iteration {:3d}   cost {:.6e}   gradient {:.1e}   step {:.1e}   {}",
                                       row.iteration, row.cost, row.gradient_norm, row.step_norm,
                                       counted(row.simulations, "simulation")));
    long_run.add_iterate(
        {{"iteration", row.iteration}, {"cost", row.cost}, {"parameters", entries_of(row.parameters)}});
    return !interrupted();
  };
  IdentificationResult fit = run_identification(problem, data, options);
  run.progress.finish();
  if (run.problem.identification->multistart) describe_given(given, fit);
  return fit;
}

// Fits simulated records, as the command line requests.
void add_recovery(Run& run, const CutProblem& cut, const IdentificationResult& fit) {
  RecoveryOptions options;
  options.threads = case_threads(run);
  options.seeds = run.context.options.recover;
  options.simulation_progress = fit_progress(run);
  options.progress = [&](int done) {
    run.progress.iteration(fmt::format("recovery   {} of {}", done, options.seeds));
    return !interrupted();
  };
  const Recovery recovery = recover(cut.problem, cut.data, fit, options);
  run.progress.finish();
  if (recovery.failed > 0)
    run.warn(fmt::format("--recover: {} of {} fits of simulated records failed", recovery.failed,
                         recovery.failed + recovery.fits));
  show_recovery(run, recovery);
}

// Residuals at the initial values, with warnings of wrong derivatives; for --preflight with what the data determine
// there.
IdentificationResult at_start(Run& run, const Problem& needed, const std::vector<CsvTable>& data) {
  IdentificationOptions options;
  options.threads = case_threads(run);
  options.simulation_progress = [](double) { return !interrupted(); };
  FitStart start = start_of_fit(needed, data, options);
  run.warn(start.warnings);
  if (!run.context.options.preflight) return std::move(start.residuals);
  options = simulating(run);
  options.preflight = true;
  start.residuals = run_identification(needed, data, options);
  run.progress.finish();
  return std::move(start.residuals);
}

void show_channel_data(Run& run, const Problem& cut, const std::vector<CsvTable>& data,
                       const IdentificationResult& start) {
  std::vector<ChannelData> channels = channel_data(cut, data);
  add_residuals(channels, cut, start);
  run.context.out << '\n' << channel_table(channels);
  run.result["preflight"]["channels"] = to_json(channels);
}

int preflight(Run& run, const IdentificationResult& start) {
  if (start.residuals.empty()) {
    run.failed(start.message);
    return run.finish();
  }
  show_preflight(run, start);
  run.warn(start.warnings);
  return run.finish();
}

// The scene of the first fitted experiment, which represents all of them when an integrator is chosen or judged.
Scene simulated_scene(const Problem& problem, const std::vector<CsvTable>& data) {
  const std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  std::size_t e = 0;
  while (e + 1 < experiments.size() && experiments[e].validate) ++e;
  return Experiment(problem.scene, experiments[e], place_of(*problem.identification, e), data[e],
                    parameter_values(problem.scene), {})
      .simulated();
}

struct SimulatedExperiment : RecordedMotion {
  Scene scene;
  SimulationResult simulation;
};

SimulatedExperiment simulated_experiment(Run& run, Scene scene) {
  SimulatedExperiment motion{{}, std::move(scene), {}};
  const Mechanism mechanism(motion.scene, parameter_values(motion.scene),
                            std::vector<bool>(motion.scene.parameters.size(), false));
  RunOptions options;
  options.progress = fit_progress(run);
  const Sampling sampling = record_motion(mechanism, motion.scene, motion);
  motion.simulation = simulate(mechanism, motion.scene.simulation, {}, sampling, options);
  return motion;
}

// Residuals are derived along with the motion, by runs that do not report their steps. So this runs one that does.
SimulatedExperiment simulate_first_experiment(Run& run, const Problem& needed, const std::vector<CsvTable>& data) {
  SimulatedExperiment experiment = simulated_experiment(run, simulated_scene(needed, data));
  const SimulationResult& first = experiment.simulation;
  run.result["simulation"] = to_json(first.statistics);
  if (first.ok()) run.warn(simulation_warnings(experiment.scene, experiment.scene.simulation, first.statistics));
  warn_of_stiffness(run, first.statistics, true);
  return experiment;
}

// Positions that were measured in the first fitted experiment. The channel's gain and bias turn its measurement into
// that of the sensor. Channels are left out if gain or bias depend on more than parameters.
std::vector<PointTarget> measured_points(const Problem& fitted, const Scene& scene, const IdentificationResult& fit) {
  const std::vector<ExperimentSpec>& experiments = fitted.identification->experiments;
  const auto first = std::ranges::find(experiments, false, &ExperimentSpec::validate);
  const auto number = static_cast<std::size_t>(first - experiments.begin());
  if (first == experiments.end()) return {};
  const SceneFacts facts(scene);
  std::vector<SensorValues> values(first->channels.size());
  std::vector<std::array<std::optional<double>, 3>> corrections;
  for (std::size_t c = 0; c < values.size(); ++c) {
    const ChannelSpec& channel = first->channels[c];
    values[c].sensor = channel.sensor;
    corrections.push_back({facts.value(channel.gain), facts.value(channel.bias), facts.value(channel.delay)});
  }
  for (const ResidualRow& row : fit.residuals) {
    if (row.experiment != number) continue;
    const auto& [gain, bias, delay] = corrections[row.channel];
    if (!gain || !bias || !delay || *gain == 0) continue;
    values[row.channel].t.push_back(row.t - *delay);
    values[row.channel].value.push_back((row.measured - *bias) / *gain);
  }
  return point_targets(scene, values, true);
}

std::vector<NewValue> new_values(const IdentificationResult& fit) {
  std::vector<NewValue> values;
  for (const FittedParameter& p : fit.parameters) values.push_back({p.experiment, p.parameter, p.value});
  for (const ExperimentFit& e : fit.experiments) {
    for (const FittedParameter& p : e.refitted) values.push_back({p.experiment, p.parameter, p.value});
  }
  return values;
}

}  // namespace

int identify_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (!run.problem.identification) {
    throw std::invalid_argument("identification: missing; it says which measurements to explain and what may change");
  }
  std::vector<std::string> moved;
  const std::vector<CsvTable> whole = data_of(run.problem, &moved);
  for (const std::string& words : moved) {
    run.result["columns"].push_back(words);
    if (!context.options.quiet) context.err << words << '\n';
  }
  // The scene includes its drives and overrides; without them it may not assemble.
  const Scene first = simulated_scene(run.problem, whole);
  const Mechanism mechanism(first, parameter_values(first));
  run.start();
  if (!settle_accuracy(run, first, {})) return run.finish();
  const CutProblem cut = cut_into_windows(run.problem, whole, fit_progress(run));  // by the settled integrator
  run.progress.finish();
  const std::vector<CsvTable>& data = cut.data;
  if (const Assembly assembly(mechanism, first.simulation.start_time); assembly.result().ok) {
    ModelSummary model = assembly.summary();
    add_model(mechanism, scene.simulation, model);
    run.result["model"] = to_json(model);
    print_model(context.out, scene.name, model);
    run.warn(model_warnings(mechanism, assembly));
  }
  std::vector<std::string> left_out;
  const Problem needed = what_measurements_need(cut.problem, &left_out);
  say_left_out(run, left_out, "measurement");
  if (context.options.preflight) run.warn(cut.warnings);  // a fit cuts again, at the best start, and warns then
  add_windows(run, cut.problem);
  const SimulatedExperiment before = simulate_first_experiment(run, needed, data);
  const IdentificationResult start = at_start(run, needed, data);
  show_channel_data(run, needed, data, start);
  if (context.options.preflight) return preflight(run, start);
  LongRun long_run(run);
  const BestStart best = from_best_start(long_run, whole);
  const char* const kept = run.problem.identification->multistart && interrupted() ? "best of the starts" : "best fit";
  long_run.begin();
  IdentificationResult fit = fitted(long_run, best.problem, whole, cut.problem);
  fit.simulations += best.simulations;
  fit.wall_seconds += best.wall_seconds;
  if (fit.history.empty())  // it was stopped before its first evaluation
    fit.cost_initial = fit.cost_final = std::numeric_limits<double>::quiet_NaN();
  set_units(fit, cut.problem, data);
  add_to_result(run.result, fit);
  RunPage page(run);
  show_fit(page, fit, effort(run, fit.simulations, fit.wall_seconds));
  run.warn(fit.warnings);
  const Trajectory history = history_of(fit);
  run.write("optimized.json", optimized_problem_text(run, new_values(fit)));
  run.write("history.csv", to_csv(history));
  run.write("residuals.csv", residuals_csv(fit));
  if (fit.ok() && context.options.recover > 0 && !interrupted()) add_recovery(run, cut, fit);
  const Problem explained = with_fitted_values(needed, fit);
  std::optional<SimulatedExperiment> after;
  if (!interrupted() && before.simulation.ok()) after = simulated_experiment(run, simulated_scene(explained, data));
  run.progress.finish();
  if (fit.status == SolverStatus::stopped || interrupted()) {
    long_run.stopped(fmt::format("optimized.json holds the {} so far", kept));
  } else if (!fit.ok()) {
    long_run.failed(fit.status, fit.message);
  }
  if (after && after->simulation.ok()) {
    page.heading("Motion of the first experiment");
    add_motion(page, {{"initial", before.scene, before.trajectory, true},
                      {"fitted", after->scene, after->trajectory, false, measured_points(explained, after->scene, fit),
                       after->forces}});
  }
  add_fit_plots(page, cut.problem, data, fit, start);
  add_convergence(page, history);
  page.write();
  return long_run.finish();
}

}  // namespace mbsopt::inline app
