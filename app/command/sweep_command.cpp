// Computes objectives at many points: sweep.csv, their ranges, and in the report the best points and plots.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "app/report/run_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/trajectory_csv.hpp"
#include "app/run/command.hpp"
#include "app/run/sweep_points.hpp"
#include "app/starts/sweep_blocks.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

using Point = std::vector<double>;  // a row of sweep.csv; NaN: no value

struct SweptObjective {
  std::string name, unit;
  std::size_t value, judged;                     // its columns; judged: the true extreme if it is one, else the value
  std::optional<double> lower = {}, upper = {};  // limits of the design

  std::string title() const { return judged == value ? name : name + " (true)"; }
  bool misses_limit(const Point& point) const {
    return (lower && point[judged] < *lower) || (upper && point[judged] > *upper);
  }
};

struct Sweep {
  Trajectory table;  // sweep.csv: point, varied parameters, objectives with their true extremes, gradients
  std::vector<const Parameter*> varied;
  std::vector<SweptObjective> objectives;
  std::size_t best_by = 0;  // the objective of the design, else the first
  bool has_limits = false;
  std::vector<const Point*> best;  // points with values: first those that keep all limits, then the least objective

  bool keeps_limits(const Point& point) const {
    return std::ranges::none_of(objectives, [&](const SweptObjective& o) { return o.misses_limit(point); });
  }
};

void add_objective(Sweep& sweep, const Problem& problem, const ObjectiveSpec& spec, std::string unit, bool gradients) {
  std::vector<std::string>& columns = sweep.table.columns;
  SweptObjective o{spec.name, std::move(unit), columns.size(), columns.size()};
  columns.push_back(spec.name);
  if (spec.is_extreme()) {
    o.judged = columns.size();
    columns.push_back(spec.name + " true");
  }
  for (const Parameter* p : sweep.varied)
    if (gradients) columns.push_back("d " + spec.name + "/d " + p->name);
  if (problem.design) {
    if (spec.name == problem.design->minimize || spec.name == problem.design->maximize)
      sweep.best_by = sweep.objectives.size();
    const auto bound = std::ranges::find(problem.design->subject_to, spec.name, &ObjectiveBound::objective);
    if (bound != problem.design->subject_to.end()) {
      o.lower = bound->lower;
      o.upper = bound->upper;
    }
  }
  sweep.has_limits = sweep.has_limits || o.lower || o.upper;
  sweep.objectives.push_back(std::move(o));
}

// The columns of the result. Points that were not computed have none.
Sweep sweep_of(const Problem& problem, const SweepPoints& points, const std::vector<Json>& rows, bool gradients) {
  Sweep sweep;
  sweep.table.columns = {"point"};
  for (const int p : points.parameters) {
    sweep.varied.push_back(&problem.scene.parameters[static_cast<std::size_t>(p)]);
    sweep.table.columns.push_back(sweep.varied.back()->name);
  }
  const ObjectiveUnits units = objective_units(problem);
  for (const ObjectiveSpec& spec : problem.objectives)
    add_objective(sweep, problem, spec, shown_unit(units, spec.name), gradients);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].is_null()) continue;
    Point& point = sweep.table.rows.emplace_back(Point{static_cast<double>(i + 1)});
    point.insert(point.end(), points.values[i].begin(), points.values[i].end());
    point.resize(sweep.table.columns.size(), std::numeric_limits<double>::quiet_NaN());
    if (rows[i].contains("failed")) continue;
    for (std::size_t o = 0; o < sweep.objectives.size(); ++o) {
      const SweptObjective& objective = sweep.objectives[o];
      point[objective.value] = rows[i]["psi"][o].get<double>();
      if (objective.judged != objective.value && rows[i]["true"][o].is_number())
        point[objective.judged] = rows[i]["true"][o].get<double>();
      for (std::size_t p = 0; gradients && p < sweep.varied.size(); ++p)
        point[objective.judged + 1 + p] = rows[i]["psi_rho"][o][p].get<double>();
    }
  }
  const std::size_t ranked = sweep.objectives[sweep.best_by].judged;
  for (const Point& point : sweep.table.rows)
    if (std::isfinite(point[ranked])) sweep.best.push_back(&point);
  std::ranges::stable_sort(
      sweep.best, {}, [&](const Point* point) { return std::pair(!sweep.keeps_limits(*point), (*point)[ranked]); });
  return sweep;
}

// The least and largest value of each objective, with the numbers of their points.
void add_ranges(RunPage& page, const Sweep& sweep, std::size_t points) {
  TextTable table({"objective", "unit", "least", "at point", "largest", "at point"});
  for (const SweptObjective& o : sweep.objectives) {
    std::vector<const Point*> judged;
    for (const Point& point : sweep.table.rows)
      if (!std::isnan(point[o.judged])) judged.push_back(&point);
    if (judged.empty()) continue;
    const auto value = [&](const Point* point) { return (*point)[o.judged]; };
    const Point& least = **std::ranges::min_element(judged, {}, value);
    const Point& largest = **std::ranges::max_element(judged, {}, value);
    Json& range = page.run.result["sweep"]["objectives"][o.name];
    range = {{"of", o.judged == o.value ? "value" : "true_value"},
             {"least", least[o.judged]},
             {"least_at", static_cast<std::size_t>(least.front())},
             {"largest", largest[o.judged]},
             {"largest_at", static_cast<std::size_t>(largest.front())}};
    if (o.unit != kUnknownUnit) range["unit"] = o.unit;
    table.add({o.title(), o.unit, significant(least[o.judged]), cell(range["least_at"]), significant(largest[o.judged]),
               cell(range["largest_at"])});
  }
  page.run.context.out << fmt::format("{} points of {}\n", points, counted(sweep.varied.size(), "parameter"));
  page.run.context.out << (table.empty() ? "\n" : "");
  if (!table.empty()) page.print(table);
}

std::string unit_label(const Parameter& p) { return p.unit.empty() ? p.name : fmt::format("{} [{}]", p.name, p.unit); }

std::string name_of(const Point& point) { return fmt::format("point {:.0f}", point.front()); }

std::string place_of(const Sweep& sweep, const Point& point) {
  constexpr std::size_t kMost = 3;  // parameters in a sentence
  std::string words;
  for (std::size_t k = 0; k < std::min(kMost, sweep.varied.size()); ++k)
    words += fmt::format("{}{} = {:.5g}{}", k == 0 ? "" : ", ", sweep.varied[k]->name, point[1 + k],
                         sweep.varied[k]->unit.empty() ? "" : " " + sweep.varied[k]->unit);
  return fmt::format("{} ({}{})", name_of(point), words, sweep.varied.size() > kMost ? ", ..." : "");
}

// "15 of 15 points have values; track from 0.0123 m^2 at point 3 (k = 10 N/m) to 2.31 m^2 at point 6."
void add_verdict(RunPage& page, const Sweep& sweep, std::size_t points) {
  std::string words = fmt::format("{} of {} have values", sweep.best.size(), counted(points, "point"));
  if (sweep.has_limits)
    words += fmt::format(", {} keep the limits of the design",
                         std::ranges::count_if(sweep.best, [&](const Point* p) { return sweep.keeps_limits(*p); }));
  constexpr std::size_t kMost = 3;  // objectives in a sentence
  for (std::size_t o = 0; !sweep.best.empty() && o < std::min(kMost, sweep.objectives.size()); ++o) {
    const std::size_t column = sweep.objectives[o].judged;
    const auto [low, high] = std::ranges::minmax_element(sweep.best, {}, [&](const Point* p) { return (*p)[column]; });
    const std::string unit = after_number({{"unit", sweep.objectives[o].unit}});
    words += fmt::format("; {} from {:.5g}{} at {} to {:.5g}{} at {}", sweep.objectives[o].title(), (**low)[column],
                         unit, place_of(sweep, **low), (**high)[column], unit, name_of(**high));
  }
  page.verdict(words + ".");
}

void add_best_points(RunPage& page, const Sweep& sweep) {
  if (sweep.best.empty()) return;
  constexpr std::size_t kMost = 20;  // rows that a reader compares
  const std::size_t shown = std::min(kMost, sweep.best.size());
  page.heading("Best points");
  page.paragraph(fmt::format("The {} with the least {}, of {} with values{}. All points stand in sweep.csv.",
                             counted(shown, "point"), sweep.objectives[sweep.best_by].title(), sweep.best.size(),
                             sweep.has_limits ? "; points that keep the limits of the design come first" : ""));
  std::vector<std::string> header{"point"};
  for (const Parameter* p : sweep.varied) header.push_back(unit_label(*p));
  for (const SweptObjective& o : sweep.objectives) {
    header.push_back(fmt::format("{} [{}]", o.name, o.unit));
    if (o.judged != o.value) header.push_back(o.name + " true");
  }
  if (sweep.has_limits) header.push_back("misses the limit of");
  TextTable table(header);
  for (std::size_t i = 0; i < shown; ++i) {
    const Point& point = *sweep.best[i];
    TableRow& row = table.add({fmt::format("{:.0f}", point.front())});
    for (std::size_t k = 0; k < sweep.varied.size(); ++k) row.push_back(number_cell(point[1 + k]));
    std::string missed;
    for (const SweptObjective& o : sweep.objectives) {
      row.push_back(number_cell(point[o.value]));
      if (o.judged != o.value) row.push_back(number_cell(point[o.judged]));
      if (o.misses_limit(point)) missed += (missed.empty() ? "" : ", ") + o.name;
    }
    if (sweep.has_limits) row.push_back(missed.empty() ? "-" : missed);
  }
  page.table(table);
}

// One parameter alone gives a line through its points in order. Several parameters give points above each other.
LinePlot plot_over(const Sweep& sweep, std::size_t varied, const SweptObjective& objective) {
  constexpr double kDecades = 2;  // from which a linear axis hides how small values differ
  const Parameter& p = *sweep.varied[varied];
  std::vector<const Point*> points;
  for (const Point& point : sweep.table.rows) points.push_back(&point);
  std::ranges::stable_sort(points, {}, [&](const Point* point) { return (*point)[1 + varied]; });
  PlotSeries all{"points", {}, {}, Mark::points};
  double low = INFINITY, high = -INFINITY;
  for (const Point* point : points) {
    const double value = (*point)[objective.judged];
    all.x.push_back((*point)[1 + varied]);
    all.y.push_back(value);
    if (std::isfinite(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  LinePlot plot{.title = fmt::format("{} over {}", objective.title(), p.name),
                .x_label = unit_label(p),
                .y_label = fmt::format("{} [{}]", objective.title(), objective.unit),
                .logarithmic_y = low > 0 && std::log10(high / low) > kDecades,
                .logarithmic_x = p.scale != ParameterScale::linear};
  const Point& best = *sweep.best.front();
  if (sweep.varied.size() == 1) {
    plot.series.push_back({objective.title(), all.x, all.y});
    all.part_of = 0;
  }
  plot.series.push_back(std::move(all));
  plot.series.push_back({"best point", {best[1 + varied]}, {best[objective.judged]}, Mark::rings});
  if (objective.lower) plot.limits.push_back({"at least", *objective.lower, false});
  if (objective.upper) plot.limits.push_back({"at most", *objective.upper, true});
  return plot;
}

void add_plots(RunPage& page, const Sweep& sweep) {
  if (sweep.best.empty()) return;
  constexpr std::size_t kMost = 24;  // of a page that stays below 3 MB with kMostPoints in each
  page.heading("Objectives over parameters");
  std::size_t plots = 0;
  for (const SweptObjective& objective : sweep.objectives)
    for (std::size_t k = 0; k < sweep.varied.size() && plots < kMost; ++k, ++plots)
      page.plot(plot_over(sweep, k, objective));
  const std::size_t wanted = sweep.objectives.size() * sweep.varied.size();
  if (plots < wanted) page.note(fmt::format("The first {} of {} plots are drawn.", plots, wanted));
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
  const std::vector<Json> rows = swept(long_run, points, seed);
  const auto is_failed = [](const Json& row) { return row.contains("failed"); };
  const auto done = std::ranges::count_if(rows, [](const Json& row) { return !row.is_null(); });
  const auto failed = std::ranges::count_if(rows, is_failed);
  run.result["sweep"] = {{"points", rows.size()}, {"computed", done}, {"failed", failed}};
  if (options.samples) run.result["sweep"]["seed"] = seed;
  RunPage page(run);
  const Sweep sweep = sweep_of(run.problem, points, rows, options.gradients);
  add_verdict(page, sweep, rows.size());
  add_ranges(page, sweep, rows.size());
  if (failed > 0) {
    const auto first = std::ranges::find_if(rows, is_failed);
    run.warn(fmt::format("{} of {} points have no values, the first is point {}: {}", failed, rows.size(),
                         first - rows.begin() + 1, first->at("failed").get<std::string>()));
  }
  run.write("sweep.csv", to_csv(sweep.table));
  if (interrupted())
    long_run.stopped(fmt::format("sweep.csv holds {} of {} points", done, rows.size()));
  else if (failed == done)
    run.failed("no point has values");
  add_best_points(page, sweep);
  add_plots(page, sweep);
  page.write();
  return long_run.finish();
}

}  // namespace mbsopt::inline app
