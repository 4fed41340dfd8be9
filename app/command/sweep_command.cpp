#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "app/report/run_report.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/trajectory_csv.hpp"
#include "app/run/command.hpp"
#include "app/run/run.hpp"
#include "app/run/sweep_points.hpp"
#include "app/starts/sweep_blocks.hpp"
#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"

namespace mbsopt::inline app {
namespace {

// Point, varied parameters, objectives with their true extremes, gradients. Points without values have empty cells.
Trajectory table_of(const Problem& problem, const SweepPoints& points, const std::vector<SweepRow>& rows,
                    bool gradients) {
  std::vector<std::string> columns{"point"}, varied;
  for (const int p : points.parameters) varied.push_back(problem.scene.parameters[static_cast<std::size_t>(p)].name);
  columns.insert(columns.end(), varied.begin(), varied.end());
  const std::vector<Objective> objectives = objectives_of(problem);
  for (const Objective& o : objectives) {
    columns.push_back(o.name());
    if (o.is_extreme()) columns.push_back(o.name() + " true");
    if (!gradients) continue;
    for (const std::string& parameter : varied) columns.push_back("d " + o.name() + "/d " + parameter);
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::vector<double>> cells;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].done) continue;
    std::vector<double> row{static_cast<double>(i + 1)};
    row.insert(row.end(), points.values[i].begin(), points.values[i].end());
    const bool has_values = rows[i].psi.size() > 0;
    for (std::size_t o = 0; o < objectives.size(); ++o) {
      const Eigen::Index k = static_cast<Eigen::Index>(o);
      row.push_back(has_values ? rows[i].psi(k) : kNone);
      if (objectives[o].is_extreme()) row.push_back(has_values ? rows[i].true_values[o].value_or(kNone) : kNone);
      for (std::size_t p = 0; gradients && p < varied.size(); ++p)
        row.push_back(has_values ? rows[i].psi_rho(k, static_cast<Eigen::Index>(p)) : kNone);
    }
    cells.push_back(std::move(row));
  }
  return {std::move(columns), std::move(cells)};
}

void add_ranges(Run& run, const SweepPoints& points, const std::vector<SweepRow>& rows) {
  TextTable table({"objective", "unit", "least", "at point", "largest", "at point"});
  const ObjectiveUnits units = objective_units(run.problem);
  for (std::size_t o = 0; o < run.problem.objectives.size(); ++o) {
    const ObjectiveSpec& spec = run.problem.objectives[o];
    std::vector<std::pair<double, std::size_t>> judged;  // values with the numbers of their points
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows[i].psi.size() == 0) continue;
      const std::optional<double> value =
          spec.is_extreme() ? rows[i].true_values[o] : rows[i].psi(static_cast<Eigen::Index>(o));
      if (value) judged.emplace_back(*value, i + 1);
    }
    if (judged.empty()) continue;
    const auto [least, least_at] = *std::ranges::min_element(judged, {}, &std::pair<double, std::size_t>::first);
    const auto [largest, largest_at] = *std::ranges::max_element(judged, {}, &std::pair<double, std::size_t>::first);
    Json& range = run.result["sweep"]["objectives"][spec.name];
    range = {{"of", spec.is_extreme() ? "true_value" : "value"},
             {"least", least},
             {"least_at", least_at},
             {"largest", largest},
             {"largest_at", largest_at}};
    if (!units.at(spec.name).empty()) range["unit"] = units.at(spec.name);
    table.add({spec.name + (spec.is_extreme() ? " (true)" : ""), shown_unit(units, spec.name), significant(least),
               std::to_string(least_at), significant(largest), std::to_string(largest_at)});
  }
  run.context.out << fmt::format("{} points of {} parameter{}\n\n", rows.size(), points.parameters.size(),
                                 points.parameters.size() == 1 ? "" : "s");
  if (!table.empty()) run.context.out << table.text();
}

}  // namespace

int sweep_command(const CommandContext& context) {
  Run run(context);
  const SweepOptions& options = context.options.sweep;
  if (run.problem.objectives.empty()) throw std::invalid_argument("objectives: there are none to compute");
  LongRun long_run(run);
  const long seed = options.samples ? long_run.seed("samples", options.seed) : 0;
  const SweepPoints points = sweep_points(run.problem.scene, options, seed);
  run.start();
  if (!settle_accuracy(run)) return run.finish();
  long_run.begin();
  const std::vector<SweepRow> rows = swept(long_run, points, seed);
  const auto done = std::ranges::count_if(rows, &SweepRow::done);
  const auto failed = std::ranges::count_if(rows, [](const SweepRow& row) { return !row.message.empty(); });
  run.result["sweep"] = {{"points", rows.size()}, {"computed", done}, {"failed", failed}};
  if (options.samples) run.result["sweep"]["seed"] = seed;
  add_ranges(run, points, rows);
  if (failed > 0) {
    const auto first = std::ranges::find_if(rows, [](const SweepRow& row) { return !row.message.empty(); });
    run.warn(fmt::format("{} of {} points have no values, the first is point {}: {}", failed, rows.size(),
                         first - rows.begin() + 1, first->message));
  }
  const Trajectory table = table_of(run.problem, points, rows, options.gradients);
  run.write("sweep.csv", to_csv(table));
  if (interrupted())
    long_run.stopped(fmt::format("sweep.csv holds {} of {} points", done, rows.size()));
  else if (failed == done)
    run.failed("no point has values");
  run.write("report.html", sweep_report(run.problem, points, run.result, table));
  return long_run.finish();
}

}  // namespace mbsopt::inline app
