#include <fmt/format.h>

#include "app/report/tradeoff_report.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/recommended_problem.hpp"
#include "app/results/tradeoff_csv.hpp"
#include "app/results/tradeoff_results.hpp"
#include "app/run/command.hpp"
#include "app/run/machine.hpp"
#include "app/run/run.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/scene/default_integrator.hpp"
#include "optim/fit/windows.hpp"
#include "optim/tradeoff/fit_errors.hpp"

namespace mbsopt {
namespace {

constexpr const char* kNothingMeasured = "nothing was measured yet";
constexpr const char* kMeasuredIsKept = "tradeoff.csv holds what was measured";

constexpr double kFits = 0.2;  // of the budget, for the sums of squares at settings that may be advised

void apply_accuracy(Run& run, const Tradeoff& tradeoff, TaskAdviser& adviser, double accuracy) {
  const TaskAdvice advice = adviser.at(accuracy);
  add_applied(run, tradeoff, advice);
  if (const auto row = advice.recommendation.row)
    run.write("recommended.json", recommended_problem_text(run, tradeoff.rows[*row].setting.simulation));
}

// The sum of squares of `identify` is not an objective of the file; the integrator limits its accuracy.
void add_fit(Run& run, const FitErrorMeasure& fit) {
  const SimulationSettings& own = run.problem.scene.simulation;
  SimulationSettings defaults = own;
  defaults.formulation = {}, defaults.integrator = default_integrator(own.start_time, own.end_time);
  FitErrors errors = fit.found();
  if (errors.ok()) errors.settings = {fit.at({"own", own}), fit.at({"defaults", defaults})};
  add_fit_errors(run, errors);
}

void sweep(Run& run) {
  TradeoffOptions options;
  options.budget_seconds = run.context.options.budget;
  options.interrupted = [] { return interrupted(); };
  options.progress = [&](const std::string& doing, double done) { run.progress.fraction(doing, done); };
  Tradeoff tradeoff = measure_tradeoff(run.problem.scene, objectives_of(run.problem), options);
  run.progress.finish();
  if (!tradeoff.ok()) {
    tradeoff.interrupted ? run.stopped("there was no reference yet, nothing is kept") : run.failed(tradeoff.message);
    return;
  }
  add_reference(run, tradeoff.reference);
  if (!tradeoff.rows.empty()) run.write("tradeoff.csv", to_csv(tradeoff));
  add_given_settings(run, tradeoff);
  const Problem& problem = run.problem;
  const std::vector<CsvTable> data = problem.identification ? data_of(problem) : std::vector<CsvTable>();
  const CutProblem cut = cut_into_windows(problem, data, {}, [](double) { return !interrupted(); });
  for (const std::string& warning : cut.warnings) run.warn(warning);
  tradeoff.interrupted = tradeoff.interrupted || interrupted();
  std::optional<FitErrorMeasure> fit;
  if (problem.identification && !tradeoff.interrupted) {
    fit.emplace(cut.problem, cut.data, [] { return interrupted(); });
    add_fit(run, *fit);
  }
  TaskAdviser adviser(problem, tradeoff, fit ? &*fit : nullptr, kFits * options.budget_seconds);
  if (options.budget_seconds > 0) {
    add_recommendations(run, tradeoff);
    if (!tradeoff.interrupted && (problem.design || fit)) add_task_recommendations(run, tradeoff, adviser);
    add_outcomes(run, tradeoff);
  }
  if (tradeoff.interrupted) {
    run.stopped(tradeoff.rows.empty() ? kNothingMeasured : kMeasuredIsKept);
  } else if (run.context.options.apply) {
    apply_accuracy(run, tradeoff, adviser, *run.context.options.apply);
  }
  run.write("report.html", tradeoff_report(run.result, tradeoff, objective_units(run.problem)));
}

void penalty_study(Run& run) {
  PenaltyStudyOptions options;
  options.alphas = alphas_of(run.context.options.alpha);
  options.budget_seconds = run.context.options.budget;
  options.interrupted = [] { return interrupted(); };
  options.progress = [&](const std::string& doing, double done) { run.progress.fraction(doing, done); };
  const PenaltyStudy study = study_penalty(run.problem.scene, objectives_of(run.problem), options);
  run.progress.finish();
  if (!study.ok()) {
    study.interrupted ? run.stopped("there was no reference yet, nothing is kept") : run.failed(study.message);
    return;
  }
  add_reference(run, study.reference);
  if (!study.rows.empty()) run.write("tradeoff.csv", to_csv(study));
  add_penalty_study(run, study);
  if (study.interrupted) run.stopped(study.rows.empty() ? kNothingMeasured : kMeasuredIsKept);
  run.write("report.html", penalty_report(run.result, study));
}

}  // namespace

int tradeoff_command(const CommandContext& context) {
  const CommandOptions& options = context.options;
  if (!options.alpha.empty()) {
    if (options.apply) throw std::invalid_argument("--apply: the study that --alpha makes recommends nothing");
    alphas_of(options.alpha);  // throws
  } else if (options.apply && options.budget == 0) {
    throw std::invalid_argument("--apply: with --budget 0 nothing is measured that could be recommended");
  }
  Run run(context);
  const Scene& scene = run.problem.scene;
  const Mechanism mechanism(scene, parameter_values(scene));
  run.start();
  const Json machine = machine_json();
  run.result["machine"] = machine;
  if (!settle_accuracy(run)) return run.finish();
  if (!assembled(run, mechanism, Assembly(mechanism, scene.simulation.start_time))) return run.finish();
  context.out << machine_name(machine) << '\n';
  const Json& load = machine.at("load");
  if (load.is_number() && load.get<double>() > 0.7 * machine.at("cores").get<double>())
    run.warn(fmt::format("the machine is busy (load {:.1f}): times come out longer than they are", load.get<double>()));
  options.alpha.empty() ? sweep(run) : penalty_study(run);
  return run.finish();
}

}  // namespace mbsopt
