#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/tradeoff_results.hpp"
#include "app/run/provenance.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {
namespace {

void add_reference(HtmlPage& page, const Json& result, const TradeoffReference& reference) {
  page.heading("Reference");
  page.paragraph(fmt::format("{}, certified by {}: smaller errors than the difference of these two cannot be measured.",
                             in_words(reference.first), in_words(reference.second)));
  std::vector<TableRow> rows;
  for (const Quantity& q : reference.errors->quantities())
    rows.push_back({q.name, q.relative ? "relative" : "absolute", error_text(q.certificate)});
  page.table({"quantity", "errors are", "two methods apart"}, rows);
  const Json others = result.at("reference").value("without_integration", Json::array());
  if (!others.empty())
    page.paragraph(fmt::format("Not measured, since they do not depend on the integration: {}.",
                               fmt::join(others.get<std::vector<std::string>>(), ", ")));
}

// A plot shows the curves of a quantity for one group of methods.
constexpr std::string_view kExplicit = "explicit methods", kImplicit = "implicit and multistep methods",
                           kFormulation = "formulations", kGradient = "gradient methods";

std::string_view group_of(const TradeoffSetting& setting) {
  if (setting.gradient) return kGradient;
  if (setting.curve != setting.simulation.integrator.type) return kFormulation;
  return explicit_method(setting.curve) ? kExplicit : kImplicit;
}

constexpr std::size_t kInk = 7;  // the colour of the style that is grey

// The row of the file's own settings that holds a quantity, if it was measured.
std::optional<std::size_t> own_row(const Tradeoff& tradeoff, const Quantity& q) {
  const std::optional<std::size_t> own = q.kind == QuantityKind::gradient ? tradeoff.own_gradient : tradeoff.own;
  return own && tradeoff.rows[*own].ok() ? own : std::nullopt;
}

std::string unit_of_error(const Quantity& q, const ObjectiveUnits& units) {
  if (q.relative) return "-";
  return q.kind == QuantityKind::objective ? shown_unit(units, q.objective_name) : kUnknownUnit;
}

// Draws lines through bounds. It draws points for errors below their bound, and for settings that a tighter one
// dominates.
LinePlot work_precision(const Tradeoff& tradeoff, const ObjectiveUnits& units, std::size_t quantity,
                        std::string_view group) {
  const std::vector<TradeoffRow>& rows = tradeoff.rows;
  const Quantity& q = tradeoff.quantities()[quantity];
  const auto column = static_cast<Eigen::Index>(quantity);
  LinePlot plot{.title = fmt::format("{}: {}", q.name, group),
                .x_label = "time [s]",
                .y_label = fmt::format("{} error of {} [{}]", q.relative ? "relative" : "absolute", q.name,
                                       unit_of_error(q, units)),
                .logarithmic_y = true,
                .logarithmic_x = true};
  const auto add = [&](PlotSeries& series, std::size_t row, Eigen::VectorXd TradeoffRow::*errors) {
    series.x.push_back(rows[row].wall_seconds), series.y.push_back((rows[row].*errors)(column));
  };
  std::vector<PlotSeries> points;
  for (const WorkPrecisionCurve& curve : work_precision_curves(rows, tradeoff.quantities(), quantity)) {
    if (group_of(rows[curve.line.front()].setting) != group) continue;
    PlotSeries off_line{"", {}, {}, Mark::points, plot.series.size()};
    PlotSeries& line = plot.series.emplace_back(PlotSeries{curve.name, {}, {}, Mark::line});
    const std::vector<std::size_t> connected = slower_and_slower(rows, curve.line);
    for (const std::size_t i : connected) add(line, i, &TradeoffRow::bounds);
    if (connected.size() == 1) add(off_line, connected.front(), &TradeoffRow::bounds);
    for (const std::vector<std::size_t>* some : {&curve.line, &curve.beside})
      for (const std::size_t i : *some)
        if (!std::ranges::binary_search(connected, i) || rows[i].errors(column) < rows[i].bounds(column))
          add(off_line, i, &TradeoffRow::errors);
    if (!off_line.x.empty()) points.push_back(std::move(off_line));
  }
  if (plot.series.empty()) return plot;
  plot.series.insert(plot.series.end(), points.begin(), points.end());
  PlotSeries front{"Pareto front", {}, {}, Mark::rings};
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (group_of(rows[i].setting) == group && rows[i].pareto[quantity] && better_than_zero(q, rows[i].bounds(column)))
      add(front, i, &TradeoffRow::bounds);
  if (!front.x.empty()) plot.series.push_back(std::move(front));
  if (const auto own = own_row(tradeoff, q))
    add(plot.series.emplace_back(PlotSeries{"as in the file", {}, {}, Mark::crosses, {}, kInk}), *own,
        &TradeoffRow::errors);
  return plot;
}

constexpr const char* kHowToRead =
    "Lines lead from loose to tight settings through bounds: the bound of a setting is the largest error of it and of "
    "all tighter settings of its curve, since an error that passes through zero is small by chance. Points in a "
    "curve's colour beside its line: errors that are below their bounds, and settings for which a tighter one needed "
    "no more right-hand sides or no more time. A relative bound of 1 or more, as the answer zero would have, is left "
    "out.";

// "The fastest setting for 1e-06 in track: dopri5 at rtol 1e-05, 12 ms (error 3e-07); as in the file: 1.2e-04 in 8 ms."
std::string sentence_of(const Json& result, const Tradeoff& tradeoff, std::size_t quantity) {
  constexpr double kWanted = 1e-6;  // accuracy that suits most tasks; else the tightest that some setting has
  const Quantity& q = tradeoff.quantities()[quantity];
  std::string words = fmt::format("{}: no setting was exact enough to be advised", q.name);
  for (const Json& r : result.value("recommendations", Json::array()))
    if (r.value("quantity", "") == q.name && r.contains("setting") && r.at("accuracy").get<double>() >= 0.99 * kWanted)
      words = "The fastest setting " + r.at("in_words").get<std::string>();
  if (const auto own = own_row(tradeoff, q))
    words += fmt::format("; as in the file: error {} in {}",
                         error_text(tradeoff.rows[*own].errors(static_cast<Eigen::Index>(quantity)), q.certificate),
                         duration_text(tradeoff.rows[*own].wall_seconds));
  return words + ".";
}

void add_plots(HtmlPage& page, const Json& result, const Tradeoff& tradeoff, const ObjectiveUnits& units) {
  bool any = false;
  for (std::size_t q = 0; q < tradeoff.quantities().size(); ++q) {
    for (const std::string_view group : {kExplicit, kImplicit, kFormulation, kGradient}) {
      const LinePlot plot = work_precision(tradeoff, units, q, group);
      if (plot.series.empty()) continue;
      if (!std::exchange(any, true)) page.heading("Error over time"), page.begin_choices({"error of", "with"});
      page.begin_choice({tradeoff.quantities()[q].name, std::string(group)});
      page.paragraph(sentence_of(result, tradeoff, q));
      page.plot(plot);
      page.end_choice();
    }
  }
  if (any) page.end_choices(), page.note(kHowToRead);
}

void add_recommendations(HtmlPage& page, const Json& result) {
  if (!result.contains("recommendations")) return;
  page.heading("What to use");
  std::vector<TableRow> rows;
  for (const char* list : {"recommendations", "task_recommendations"})
    for (const Json& r : result.value(list, Json::array()))
      rows.push_back(
          {cell(r.at("aim")), fmt::format("{:.0e}", r.at("accuracy").get<double>()), cell(r.at("setting_in_words"))});
  page.table({"quantity", "accuracy", "fastest setting"}, rows);
  if (result.contains("applied") && result.at("applied").contains("setting"))
    page.paragraph("Applied in recommended.json, " + result.at("applied").at("in_words").get<std::string>() + ".");
}

void add_rows(HtmlPage& page, const Tradeoff& tradeoff) {
  if (tradeoff.rows.empty()) return;
  page.heading("All settings");
  std::vector<std::string> header{"setting", "time [ms]", "repetitions", "steps", "right-hand sides", "factorisations"};
  const std::vector<Quantity>& quantities = tradeoff.quantities();
  for (const Quantity& q : quantities) header.push_back(q.name);
  std::vector<TableRow> rows, without;  // without: settings that have no result
  for (const TradeoffRow& r : tradeoff.rows) {
    const Json columns = columns_of(r, quantities);
    if (!r.ok()) {
      without.push_back({in_words(r.setting), cell(columns.at("status")), r.message});
      continue;
    }
    TableRow& row = rows.emplace_back(TableRow{in_words(r.setting), fmt::format("{:.3g}", 1e3 * r.wall_seconds)});
    for (const char* count : {"repetitions", "steps", "rhs_evaluations", "factorisations"})
      row.push_back(columns.at(count).dump());
    for (std::size_t q = 0; q < quantities.size(); ++q)
      row.push_back(error_text(r.errors(static_cast<Eigen::Index>(q)), quantities[q].certificate) +
                    (r.pareto[q] ? " *" : ""));
  }
  page.table(header, rows);
  page.paragraph(
      "* on the Pareto front of time and bound: nothing measured is both faster and more exact. tradeoff.csv holds the "
      "bounds, too.");
  if (without.empty()) return;
  page.heading("Settings without a result");
  page.table({"setting", "outcome", "why"}, without);
}

void add_machine(HtmlPage& page, const Json& result) {
  page.paragraph("Times are medians, measured on " + machine_name(result.at("machine")) + ".");
}

}  // namespace

std::string tradeoff_report(const Json& result, const Tradeoff& tradeoff, const ObjectiveUnits& units) {
  HtmlPage page(report_title(result));
  const Json recommendations = result.value("recommendations", Json::array());
  const auto measured = std::ranges::count(tradeoff.rows, RowStatus::ok, &TradeoffRow::status);
  if (!tradeoff.reference.errors->moves())
    page.verdict("Nothing moves, so all settings are equally exact.");
  else if (!recommendations.empty())
    page.verdict(fmt::format("{} settings were measured; the fastest {}.", measured,
                             recommendations.front().at("in_words").get<std::string>()));
  add_status(page, result);
  add_machine(page, result);
  add_recommendations(page, result);
  add_plots(page, result, tradeoff, units);
  add_reference(page, result, tradeoff.reference);
  add_rows(page, tradeoff);
  return finished(page, result);
}

std::string penalty_report(const Json& result, const PenaltyStudy& study) {
  HtmlPage page(report_title(result));
  struct OverAlpha {
    std::string name;
    std::function<double(const PenaltyStudyRow&)> value_of;
    Mark mark = Mark::line;
  };
  const auto add_plot = [&](const std::string& title, const std::string& label, const std::vector<OverAlpha>& curves) {
    LinePlot plot{
        .title = title, .x_label = "alpha [-]", .y_label = label, .logarithmic_y = true, .logarithmic_x = true};
    for (const OverAlpha& curve : curves) {
      PlotSeries& series = plot.series.emplace_back(PlotSeries{curve.name, {}, {}, curve.mark});
      for (const PenaltyStudyRow& row : study.rows)
        series.x.push_back(row.alpha), series.y.push_back(curve.value_of(row));
    }
    page.plot(plot);
  };
  add_status(page, result);
  add_machine(page, result);
  page.heading("Accelerations");
  std::vector<std::string> header{"alpha"};
  std::vector<OverAlpha> of_accelerations;
  for (const AccelerationError& e : kAccelerationErrors) {
    header.push_back(e.words);
    const bool is_penalty = e.value != &PenaltyStudyRow::augmented_error;
    of_accelerations.push_back({e.legend, e.value, is_penalty ? Mark::line : Mark::dashed});
  }
  add_plot("Relative error of accelerations", "relative error [-]", of_accelerations);
  std::vector<TableRow> rows, runs;
  for (const PenaltyStudyRow& row : study.rows) {
    const std::string alpha = fmt::format("{:.0e}", row.alpha);
    TableRow& cells = rows.emplace_back(TableRow{alpha});
    for (const AccelerationError& e : kAccelerationErrors) cells.push_back(error_text(row.*e.value));
    for (const PenaltyRun& solver : kPenaltyRuns) {
      const TradeoffRow& r = study.table.rows[row.*solver.row];
      runs.push_back({alpha, solver.words, std::to_string(r.statistics.rhs_evaluations),
                      r.ok() ? fmt::format("{:.3g}", r.wall_seconds) : "-",
                      r.ok() ? error_text(r.statistics.max_position_violation) : "-", r.ok() ? "ok" : r.message});
    }
  }
  page.table(header, rows);
  page.heading("Runs");
  page.paragraph(fmt::format("{} at rtol {:g}; xi {:g}, omega {:g}.", study.integrator.type, study.integrator.rtol,
                             study.formulation.xi, study.formulation.omega));
  Eigen::Index column = 0;
  for (const Quantity& q : study.table.quantities()) {
    std::vector<OverAlpha> curves;
    for (const PenaltyRun& solver : kPenaltyRuns)
      curves.push_back(
          {solver.words, [&](const PenaltyStudyRow& row) { return study.table.rows[row.*solver.row].errors(column); }});
    curves.push_back({"rounding by Cholesky on equal steps",
                      [&](const PenaltyStudyRow& row) { return row.rounding(column); }, Mark::dashed});
    add_plot("Error of " + q.name, fmt::format("error of {} [{}]", q.name, q.relative ? "-" : kUnknownUnit), curves);
    ++column;
  }
  page.table({"alpha", "solver", "right-hand sides", "time [s]", "drift", "outcome"}, runs);
  add_reference(page, result, study.table.reference);
  return finished(page, result);
}

}  // namespace mbsopt::inline app
