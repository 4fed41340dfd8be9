#include <fmt/format.h>

#include "app/report/tradeoff_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/optimized_problem.hpp"
#include "app/results/tradeoff_results.hpp"
#include "app/run/command.hpp"
#include "app/run/provenance.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/fit/windows.hpp"

namespace mbsopt::inline app {
namespace {

// Measures, and shows what was measured.
void sweep(Run& run) {
  constexpr double kFits = 0.2;  // of the budget, for the sums of squares at settings that may be advised
  const TradeoffOptions options{
      .budget_seconds = run.context.options.budget,
      .interrupted = [] { return interrupted(); },
      .progress = [&](const std::string& doing, double done) { run.progress.fraction(doing, done); }};
  const Problem& problem = run.problem;
  Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), options);
  run.progress.finish();
  if (!tradeoff.ok())
    return tradeoff.interrupted ? run.stopped("there was no reference yet, nothing is kept")
                                : run.failed(tradeoff.message);
  RunPage page(run);
  show_reference(page, tradeoff.reference);
  if (!tradeoff.rows.empty()) run.write("tradeoff.csv", to_csv(tradeoff));
  show_given_settings(run, tradeoff);
  const std::vector<CsvTable> data = problem.identification ? data_of(problem) : std::vector<CsvTable>();
  const CutProblem cut = cut_into_windows(problem, data, [](double) { return !interrupted(); });
  run.warn(cut.warnings);
  tradeoff.interrupted = tradeoff.interrupted || interrupted();
  // The sum of squares of `identify` is not an objective of the file; the integrator limits its accuracy.
  std::optional<FitErrors> fit;
  if (problem.identification && !tradeoff.interrupted)
    show_fit_errors(run, fit.emplace(cut.problem, cut.data, options.interrupted));
  TaskAdviser adviser(problem, tradeoff, fit ? &*fit : nullptr, kFits * options.budget_seconds);
  if (options.budget_seconds > 0) {
    show_recommendations(page, tradeoff, !tradeoff.interrupted && (problem.design || fit) ? &adviser : nullptr);
    show_outcomes(run, tradeoff);
  }
  if (tradeoff.interrupted) {
    run.stopped(tradeoff.rows.empty() ? "nothing was measured yet" : "tradeoff.csv holds what was measured");
  } else if (run.context.options.apply) {
    const Recommendation advice = adviser.at(*run.context.options.apply);
    show_applied(page, tradeoff, advice, adviser.fit());
    if (advice.row)
      run.write("recommended.json", recommended_problem_text(run, tradeoff.rows[*advice.row].setting.simulation));
  }
  add_work_precision(page, tradeoff);
  page.write();
}

}  // namespace

int tradeoff_command(const CommandContext& context) {
  const CommandOptions& options = context.options;
  if (options.apply && options.budget == 0)
    throw std::invalid_argument("--apply: with --budget 0 nothing is measured that could be recommended");
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
  sweep(run);
  return run.finish();
}

}  // namespace mbsopt::inline app
