#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "app/report/mechanism_drawing.hpp"
#include "app/report/motion_plots.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/row_plot.hpp"
#include "app/report/run_report.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

// "track fell from 12.3 to 0.45 m^2 s (-96 %) in 12 iterations; no limit is missed; k is at a bound."
void add_design_verdict(HtmlPage& page, const Json& result) {
  const Json& optimizer = result.at("optimizer");
  if (result.at("objectives").empty()) return;
  const double before = optimizer.at("objective_initial").get<double>(),
               after = optimizer.at("objective_final").get<double>();
  const Json& minimised = *result.at("objectives").begin();
  std::string words = fmt::format("{} {} from {:.5g} to {:.5g}{}", result.at("objectives").begin().key(),
                                  after < before   ? "fell"
                                  : after > before ? "rose"
                                                   : "stayed",
                                  before, after, after_number(minimised));
  if (before != 0) words += fmt::format(" ({:+.3g} %)", 100 * (after - before) / std::abs(before));
  words += " in " + counted(optimizer.at("iterations").get<long>(), "iteration");
  if (result.at("objectives").size() > 1)
    words +=
        fmt::format("; the largest relative violation of a limit is {}", cell(optimizer.at("true_infeasibility"), 2));
  long at_bounds = 0;
  for (const Json& p : result.at("parameters")) at_bounds += p.value("at_bound", Json()).is_string() ? 1 : 0;
  page.verdict(fmt::format("{}; {} of {} at a bound.", words, at_bounds,
                           counted(static_cast<long>(result.at("parameters").size()), "variable")));
}

void add_parameters(HtmlPage& page, const Scene& scene, const Json& result) {
  std::vector<TableRow> rows;
  const char* const end = end_of_search(result.at("optimizer").at("status").get<std::string>());
  RowPlot plot{.title = fmt::format("Variables between their bounds (ring: start, dot: {})", end),
               .x_label = kBetween,
               .range = std::pair(-0.03, 1.03),
               .track = true};
  for (const auto& [name, p] : result.at("parameters").items()) {
    const Json lower = p.value("lower", Json()), upper = p.value("upper", Json());
    rows.push_back({name, number_cell(p.at("initial")), number_cell(p.at("value")), cell(p.value("unit", Json())),
                    number_cell(lower), number_cell(upper), cell(p.value("at_bound", Json()))});
    const std::optional<Between> between = bounds_of(scene, name, p);
    if (!between) continue;
    const double from = (*between)(p.at("initial").get<double>()), to = (*between)(p.at("value").get<double>());
    plot.rows.push_back({.name = name,
                         .low = from,
                         .high = to,
                         .ring = from,
                         .dot = to,
                         .words = cell(p.at("initial"), 4) + " \u2192 " + cell(p.at("value"), 4) + after_number(p)});
  }
  page.table({"parameter", "initial", end, "unit", "lower", "upper", "at bound"}, rows);
  page.drawing(to_svg(plot));
}

// The distance of a value from the nearer of its limits; negative beyond it.
TableCell margin_of(const Json& objective, const char* value) {
  const double x = number_of(objective, value),
               margin = std::fmin(x - number_of(objective, "lower"), number_of(objective, "upper") - x);
  return std::isfinite(margin) ? number_cell(margin, 3) : "-";
}

void add_outcome(HtmlPage& page, const Json& result) {
  const Json& optimizer = result.at("optimizer");
  page.paragraph(fmt::format("{}: {}; {}, {}.", cell(optimizer.at("type")), cell(optimizer.at("message")),
                             counted(optimizer.at("iterations").get<long>(), "iteration"),
                             counted(optimizer.at("evaluations").get<long>(), "evaluation")));
  const bool true_values = has_true_values(result);
  std::vector<TableRow> rows;
  const auto add_row = [&](const std::string& name, const Json& objective) {
    const Json extreme = objective.value("true_value", Json());
    rows.push_back({name, unit_of(objective), number_cell(objective.value("initial", Json()), 7),
                    number_cell(objective.at("value"), 7)});
    if (true_values) rows.back().push_back(number_cell(extreme, 7));
    for (const char* key : {"lower", "upper"}) rows.back().push_back(number_cell(objective.value(key, Json()), 7));
    rows.back().push_back(margin_of(objective, extreme.is_number() ? "true_value" : "value"));
    rows.back().push_back(number_cell(objective.value("price", Json()), 7));
  };
  for (const auto& [name, objective] : result.at("objectives").items()) add_row(name, objective);
  const Json cases = result.value("cases", Json::object());  // items() refers to it
  for (const auto& [load_case, of_case] : cases.items())
    for (const auto& [name, objective] : of_case.at("objectives").items())
      add_row(fmt::format("{} ({})", name, load_case), objective);
  std::vector<std::string> header{"objective", "unit", "before", "after", "at least", "at most", "margin", "price"};
  if (true_values) header.insert(header.begin() + 4, "true extreme after");
  page.table(header, rows);
  if (!result.contains("conflicts")) return;
  page.paragraph("These limits and bounds are in conflict:");
  std::vector<TableRow> conflicts;
  for (const Json& c : result["conflicts"])
    conflicts.push_back({cell(c.at("limit")), cell(c.at("missed")), cell(c.at("price"))});
  page.table({"limit", "missed by", "price"}, conflicts);
}

void add_running_terms(HtmlPage& page, const DesignMotion& before, const DesignMotion& after,
                       const std::vector<RunningTerm>& terms) {
  std::vector<LinePlot> plots;
  for (const RunningTerm& term : terms) {
    LinePlot plot{.title = term.title, .x_label = "t [s]", .y_label = term.y_label, .limits = term.limits};
    for (const DesignMotion* motion : {&before, &after}) {
      std::optional<PlotSeries> series =
          series_of(motion->running, term.objective, motion == &before ? Mark::dashed : Mark::line);
      if (!series) continue;
      series->name = motion == &before ? "before" : "after";
      plot.series.push_back(*std::move(series));
    }
    if (std::ranges::any_of(plot.series, [](const PlotSeries& s) { return std::isfinite(s.y.front()); }))
      plots.push_back(std::move(plot));
  }
  if (plots.empty()) return;
  page.heading("Objectives over time");
  for (const LinePlot& plot : plots) page.plot(plot);
}

}  // namespace

std::string design_report(const Scene& scene, const Eigen::VectorXd& rho, const Json& result, const Trajectory& history,
                          const DesignMotion& before, const DesignMotion& after, const SensorLimits& limits,
                          const std::vector<RunningTerm>& terms, const std::vector<PointTarget>& targets) {
  HtmlPage page(report_title(result));
  add_design_verdict(page, result);
  add_status(page, result);
  page.heading("Result");
  add_outcome(page, result);
  add_parameters(page, scene, result);
  const Json& objectives = result.at("objectives");
  add_convergence(page, scene, history, result.at("parameters"),
                  objectives.empty() ? kUnknownUnit : unit_of(*objectives.begin()));
  add_multistart(page, scene, result);
  page.heading("Motion before and after");
  const Scene designed = with_values(scene, rho);
  if (!after.trajectory.rows.empty())
    add_motion(page, {{"before", scene, before.trajectory, true},
                      {"after", designed, after.trajectory, false, targets, after.forces}});
  else
    add_motion(page, {{"before", scene, before.trajectory, false, targets, before.forces}});
  for (const LinePlot& plot : motion_plots(scene, before.trajectory, after.trajectory, limits)) page.plot(plot);
  add_running_terms(page, before, after, terms);
  return finished(page, result);
}

}  // namespace mbsopt::inline app
