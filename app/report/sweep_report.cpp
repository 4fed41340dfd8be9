#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "app/run/sweep_points.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

using Point = std::vector<double>;  // a row of the table

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
  std::vector<const Parameter*> varied;
  std::vector<SweptObjective> objectives;
  std::size_t best_by = 0;  // the objective of the design, else the first
  bool has_limits = false;
  std::vector<const Point*> best;  // points with values: first those that keep all limits, then the least objective

  bool keeps_limits(const Point& point) const {
    return std::ranges::none_of(objectives, [&](const SweptObjective& o) { return o.misses_limit(point); });
  }
};

Sweep sweep_of(const Problem& problem, const SweepPoints& points, const Json& ranges, const Trajectory& table) {
  Sweep sweep;
  for (const int p : points.parameters) sweep.varied.push_back(&problem.scene.parameters[static_cast<std::size_t>(p)]);
  const auto first = table.columns.begin() + 1 + static_cast<std::ptrdiff_t>(sweep.varied.size());
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(first, table.columns.end(), name) - table.columns.begin());
  };
  for (const ObjectiveSpec& spec : problem.objectives) {
    SweptObjective objective{spec.name, unit_of(ranges.value(spec.name, Json::object())), column(spec.name),
                             column(spec.name + " true")};
    if (objective.judged == table.columns.size()) objective.judged = objective.value;
    if (problem.design) {
      if (spec.name == problem.design->minimize) sweep.best_by = sweep.objectives.size();
      const auto bound = std::ranges::find(problem.design->subject_to, spec.name, &ObjectiveBound::objective);
      if (bound != problem.design->subject_to.end()) objective.lower = bound->lower, objective.upper = bound->upper;
    }
    sweep.has_limits = sweep.has_limits || objective.lower || objective.upper;
    sweep.objectives.push_back(std::move(objective));
  }
  const std::size_t ranked = sweep.objectives[sweep.best_by].judged;
  for (const Point& point : table.rows)
    if (std::isfinite(point[ranked])) sweep.best.push_back(&point);
  std::ranges::stable_sort(
      sweep.best, {}, [&](const Point* point) { return std::pair(!sweep.keeps_limits(*point), (*point)[ranked]); });
  return sweep;
}

std::string unit_label(const Parameter& p) { return p.unit.empty() ? p.name : fmt::format("{} [{}]", p.name, p.unit); }

std::string number_of(const Point& point) { return fmt::format("point {:.0f}", point.front()); }

std::string place_of(const Sweep& sweep, const Point& point) {
  constexpr std::size_t kMost = 3;  // parameters in a sentence
  std::string words;
  for (std::size_t k = 0; k < std::min(kMost, sweep.varied.size()); ++k)
    words += fmt::format("{}{} = {:.5g}{}", k == 0 ? "" : ", ", sweep.varied[k]->name, point[1 + k],
                         sweep.varied[k]->unit.empty() ? "" : " " + sweep.varied[k]->unit);
  return fmt::format("{} ({}{})", number_of(point), words, sweep.varied.size() > kMost ? ", ..." : "");
}

// "15 of 15 points have values; track from 0.0123 m^2 at point 3 (k = 10 N/m) to 2.31 m^2 at point 6."
void add_sweep_verdict(HtmlPage& page, const Sweep& sweep, const Json& counts) {
  std::string words =
      fmt::format("{} of {} have values", sweep.best.size(), counted(counts.at("points").get<std::size_t>(), "point"));
  if (sweep.has_limits)
    words += fmt::format(", {} keep the limits of the design",
                         std::ranges::count_if(sweep.best, [&](const Point* p) { return sweep.keeps_limits(*p); }));
  constexpr std::size_t kMost = 3;  // objectives in a sentence
  for (std::size_t o = 0; !sweep.best.empty() && o < std::min(kMost, sweep.objectives.size()); ++o) {
    const std::size_t column = sweep.objectives[o].judged;
    const auto [low, high] = std::ranges::minmax_element(sweep.best, {}, [&](const Point* p) { return (*p)[column]; });
    const std::string unit = after_number({{"unit", sweep.objectives[o].unit}});
    words += fmt::format("; {} from {:.5g}{} at {} to {:.5g}{} at {}", sweep.objectives[o].title(), (**low)[column],
                         unit, place_of(sweep, **low), (**high)[column], unit, number_of(**high));
  }
  page.verdict(words + ".");
}

void add_best_points(HtmlPage& page, const Sweep& sweep) {
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
  std::vector<TableRow> rows;
  for (std::size_t i = 0; i < shown; ++i) {
    const Point& point = *sweep.best[i];
    TableRow& row = rows.emplace_back(TableRow{fmt::format("{:.0f}", point.front())});
    for (std::size_t k = 0; k < sweep.varied.size(); ++k) row.push_back(number_cell(point[1 + k]));
    std::string missed;
    for (const SweptObjective& o : sweep.objectives) {
      row.push_back(number_cell(point[o.value]));
      if (o.judged != o.value) row.push_back(number_cell(point[o.judged]));
      if (o.misses_limit(point)) missed += (missed.empty() ? "" : ", ") + o.name;
    }
    if (sweep.has_limits) row.push_back(missed.empty() ? "-" : missed);
  }
  page.table(header, rows);
}

// One parameter alone gives a line through its points in order. Several parameters give points above each other.
LinePlot plot_over(const Sweep& sweep, std::size_t varied, const SweptObjective& objective, const Trajectory& table) {
  constexpr double kDecades = 2;  // from which a linear axis hides how small values differ
  const Parameter& p = *sweep.varied[varied];
  std::vector<const Point*> points;
  for (const Point& point : table.rows) points.push_back(&point);
  std::ranges::stable_sort(points, {}, [&](const Point* point) { return (*point)[1 + varied]; });
  PlotSeries all{"points", {}, {}, Mark::points};
  double low = INFINITY, high = -INFINITY;
  for (const Point* point : points) {
    const double value = (*point)[objective.judged];
    all.x.push_back((*point)[1 + varied]), all.y.push_back(value);
    if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
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

void add_plots(HtmlPage& page, const Sweep& sweep, const Trajectory& table) {
  if (sweep.best.empty()) return;
  constexpr std::size_t kMost = 24;  // of a page that stays below 3 MB with kMostPoints in each
  page.heading("Objectives over parameters");
  std::size_t plots = 0;
  for (const SweptObjective& objective : sweep.objectives)
    for (std::size_t k = 0; k < sweep.varied.size() && plots < kMost; ++k, ++plots)
      page.plot(plot_over(sweep, k, objective, table));
  const std::size_t wanted = sweep.objectives.size() * sweep.varied.size();
  if (plots < wanted) page.note(fmt::format("The first {} of {} plots are drawn.", plots, wanted));
}

}  // namespace

std::string sweep_report(const Problem& problem, const SweepPoints& points, const Json& result,
                         const Trajectory& table) {
  HtmlPage page(report_title(result));
  const Sweep sweep = sweep_of(problem, points, result.at("sweep").value("objectives", Json::object()), table);
  add_sweep_verdict(page, sweep, result.at("sweep"));
  add_status(page, result);
  add_best_points(page, sweep);
  add_plots(page, sweep, table);
  return finished(page, result);
}

}  // namespace mbsopt::inline app
