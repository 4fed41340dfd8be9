#include "app/report/tradeoff_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/results/sensor_unit.hpp"
#include "app/results/tradeoff_results.hpp"
#include "app/run/machine.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/tradeoff/tradeoff_curves.hpp"

namespace mbsopt {
namespace {

void add_reference(HtmlPage& page, const Json& result, const TradeoffReference& reference) {
  page.heading("Reference");
  page.paragraph(fmt::format("{}, certified by {}: smaller errors than the difference of these two cannot be measured.",
                             in_words(reference.first), in_words(reference.second)));
  std::vector<std::vector<std::string>> rows;
  for (const Quantity& q : reference.errors->quantities())
    rows.push_back({q.name, q.relative ? "relative" : "absolute", error_text(q.certificate)});
  page.table({"quantity", "errors are", "two methods apart"}, rows);
  const Json others = result.at("reference").value("without_integration", Json::array());
  if (!others.empty())
    page.paragraph(fmt::format("Not measured, since they do not depend on the integration: {}.",
                               fmt::join(others.get<std::vector<std::string>>(), ", ")));
}

// The plot that a curve belongs to.
enum class Group { explicit_methods, implicit_methods, formulations, gradients };

Group group_of(const TradeoffSetting& setting) {
  if (setting.gradient) return Group::gradients;
  const Method* method = runge_kutta_method(setting.simulation.integrator.type);
  if (setting.curve != setting.simulation.integrator.type) return Group::formulations;
  return method && !method->implicit() ? Group::explicit_methods : Group::implicit_methods;
}

constexpr std::size_t kInk = 7;  // the colour of the style that is grey

std::string unit_of_error(const Quantity& q, const ObjectiveUnits& units) {
  if (q.relative) return "-";
  return q.kind == QuantityKind::objective ? shown_unit(units, q.objective_name) : kUnknownUnit;
}

// Draws lines through bounds. It draws points for errors below their bound, and for settings that a tighter one
// dominates.
LinePlot work_precision(const Tradeoff& tradeoff, const ObjectiveUnits& units, std::size_t quantity, Group group,
                        const std::string& title) {
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  const Quantity& q = quantities[quantity];
  const auto column = static_cast<Eigen::Index>(quantity);
  LinePlot plot{.title = title,
                .x_label = "time [s]",
                .y_label = fmt::format("{} error of {} [{}]", q.relative ? "relative" : "absolute", q.name,
                                       unit_of_error(q, units)),
                .logarithmic_y = true,
                .logarithmic_x = true};
  std::vector<PlotSeries> points;
  const auto add = [&](PlotSeries& series, const TradeoffRow& row, const Eigen::VectorXd& errors) {
    series.x.push_back(row.wall_seconds), series.y.push_back(errors(column));
  };
  for (const WorkPrecisionCurve& curve : work_precision_curves(tradeoff.rows, quantities, quantity)) {
    if (group_of(tradeoff.rows[curve.line.front()].setting) != group) continue;
    PlotSeries off_line{"", {}, {}, Mark::points, plot.series.size()};
    PlotSeries& line = plot.series.emplace_back(PlotSeries{curve.name, {}, {}, Mark::line});
    const std::vector<std::size_t> connected = slower_and_slower(tradeoff.rows, curve.line);
    for (const std::size_t i : connected) add(line, tradeoff.rows[i], tradeoff.rows[i].bounds);
    if (connected.size() == 1) add(off_line, tradeoff.rows[connected.front()], tradeoff.rows[connected.front()].bounds);
    for (const std::vector<std::size_t>* some : {&curve.line, &curve.beside}) {
      for (const std::size_t i : *some) {
        const TradeoffRow& row = tradeoff.rows[i];
        const bool on_line = std::binary_search(connected.begin(), connected.end(), i);
        if (!on_line || row.errors(column) < row.bounds(column)) add(off_line, row, row.errors);
      }
    }
    if (!off_line.x.empty()) points.push_back(std::move(off_line));
  }
  if (plot.series.empty()) return plot;
  plot.series.insert(plot.series.end(), points.begin(), points.end());
  PlotSeries front{"Pareto front", {}, {}, Mark::rings};
  for (const TradeoffRow& row : tradeoff.rows) {
    if (group_of(row.setting) == group && row.pareto[quantity] && better_than_zero(q, row.bounds(column)))
      add(front, row, row.bounds);
  }
  if (!front.x.empty()) plot.series.push_back(std::move(front));
  const std::optional<std::size_t> own = group == Group::gradients ? tradeoff.own_gradient : tradeoff.own;
  if (own && tradeoff.rows[*own].status == RowStatus::ok) {
    PlotSeries& file = plot.series.emplace_back(PlotSeries{"as in the file", {}, {}, Mark::crosses});
    file.colour = kInk;
    add(file, tradeoff.rows[*own], tradeoff.rows[*own].errors);
  }
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
  const Quantity& q = tradeoff.reference.errors->quantities()[quantity];
  std::string words = fmt::format("{}: no setting was exact enough to be advised", q.name);
  for (const Json& r : result.value("recommendations", Json::array()))
    if (r.value("quantity", "") == q.name && r.contains("setting") && r.at("accuracy").get<double>() >= 0.99 * kWanted)
      words = "The fastest setting " + r.at("in_words").get<std::string>();
  const bool of_gradient = q.kind == QuantityKind::gradient;
  if (const auto own = of_gradient ? tradeoff.own_gradient : tradeoff.own) {
    const TradeoffRow& row = tradeoff.rows[*own];
    if (row.status == RowStatus::ok)
      words += fmt::format("; as in the file: error {} in {}",
                           error_text(row.errors(static_cast<Eigen::Index>(quantity)), q.certificate),
                           duration_text(row.wall_seconds));
  }
  return words + ".";
}

void add_plots(HtmlPage& page, const Json& result, const Tradeoff& tradeoff, const ObjectiveUnits& units) {
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  struct Titled {
    Group group;
    const char* title;
  };
  constexpr std::array kPlots{Titled{Group::explicit_methods, "explicit methods"},
                              Titled{Group::implicit_methods, "implicit and multistep methods"},
                              Titled{Group::formulations, "formulations"},
                              Titled{Group::gradients, "gradient methods"}};
  struct Chosen {
    std::size_t quantity;
    const char* methods;
    LinePlot plot;
  };
  std::vector<Chosen> choices;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    for (const Titled& p : kPlots) {
      LinePlot plot = work_precision(tradeoff, units, q, p.group, quantities[q].name + ": " + p.title);
      if (!plot.series.empty()) choices.push_back({q, p.title, std::move(plot)});
    }
  }
  if (choices.empty()) return;
  page.heading("Error over time");
  page.begin_choices({"error of", "with"});
  for (const Chosen& chosen : choices) {
    page.begin_choice({quantities[chosen.quantity].name, chosen.methods});
    page.paragraph(sentence_of(result, tradeoff, chosen.quantity));
    page.plot(chosen.plot);
    page.end_choice();
  }
  page.end_choices();
  page.note(kHowToRead);
}

void add_recommendations(HtmlPage& page, const Json& result) {
  if (!result.contains("recommendations")) return;
  page.heading("What to use");
  std::vector<std::vector<std::string>> rows;
  for (const char* list : {"recommendations", "task_recommendations"})
    for (const Json& r : result.value(list, Json::array()))
      rows.push_back({r.at("aim"), fmt::format("{:.0e}", r.at("accuracy").get<double>()), r.at("setting_in_words")});
  page.table({"quantity", "accuracy", "fastest setting"}, rows);
  if (result.contains("applied") && result.at("applied").contains("setting"))
    page.paragraph("Applied in recommended.json, " + result.at("applied").at("in_words").get<std::string>() + ".");
}

void add_rows(HtmlPage& page, const Tradeoff& tradeoff) {
  if (tradeoff.rows.empty()) return;
  page.heading("All settings");
  std::vector<std::string> header{"setting", "time [ms]", "repetitions", "steps", "right-hand sides", "factorisations"};
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  for (const Quantity& q : quantities) header.push_back(q.name);
  std::vector<std::vector<std::string>> rows, without;  // without: settings that have no result
  for (const TradeoffRow& r : tradeoff.rows) {
    if (r.status != RowStatus::ok) {
      without.push_back({in_words(r.setting), std::string(to_string(r.status)), r.message});
      continue;
    }
    std::vector<std::string> row{in_words(r.setting),
                                 fmt::format("{:.3g}", 1e3 * r.wall_seconds),
                                 std::to_string(r.repetitions),
                                 std::to_string(r.statistics.steps),
                                 std::to_string(r.statistics.rhs_evaluations),
                                 std::to_string(r.statistics.factorisations)};
    for (std::size_t q = 0; q < quantities.size(); ++q) {
      const bool front = q < r.pareto.size() && r.pareto[q];
      const auto column = static_cast<Eigen::Index>(q);
      row.push_back(error_text(r.errors(column), quantities[q].certificate) + (front ? " *" : ""));
    }
    rows.push_back(std::move(row));
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

LinePlot alpha_plot(const std::string& title, const std::string& label) {
  return {.title = title, .x_label = "alpha [-]", .y_label = label, .logarithmic_y = true, .logarithmic_x = true};
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
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

std::string penalty_report(const Json& result, const PenaltyStudy& study) {
  HtmlPage page(report_title(result));
  add_status(page, result);
  add_machine(page, result);
  page.heading("Accelerations");
  LinePlot accelerations = alpha_plot("Relative error of accelerations", "relative error [-]");
  PlotSeries model{"penalty against the constrained equations", {}, {}, Mark::line},
      rounding{"rounding by Cholesky", {}, {}, Mark::line}, augmented{"augmented Lagrangian", {}, {}, Mark::dashed};
  std::vector<std::vector<std::string>> rows;
  for (const PenaltyStudyRow& row : study.rows) {
    for (PlotSeries* s : {&model, &rounding, &augmented}) s->x.push_back(row.alpha);
    model.y.push_back(row.model_error), rounding.y.push_back(row.rounding_error);
    augmented.y.push_back(row.augmented_error);
    rows.push_back({fmt::format("{:.0e}", row.alpha), error_text(row.model_error), error_text(row.rounding_error),
                    error_text(row.augmented_error)});
  }
  accelerations.series = {model, rounding, augmented};
  page.plot(accelerations);
  page.table({"alpha", "model error", "rounding by Cholesky", "augmented Lagrangian"}, rows);
  page.heading("Runs");
  page.paragraph(fmt::format("{} at rtol {:g}; xi {:g}, omega {:g}.", study.integrator, study.rtol,
                             study.formulation.xi, study.formulation.omega));
  const std::vector<Quantity>& quantities = study.reference.errors->quantities();
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    LinePlot plot =
        alpha_plot("Error of " + quantities[q].name,
                   fmt::format("error of {} [{}]", quantities[q].name, quantities[q].relative ? "-" : kUnknownUnit));
    PlotSeries quasi{"quasi-definite", {}, {}, Mark::line}, cholesky{"cholesky", {}, {}, Mark::line},
        rounded{"rounding by Cholesky on equal steps", {}, {}, Mark::dashed};
    for (const PenaltyStudyRow& row : study.rows) {
      for (PlotSeries* s : {&quasi, &cholesky, &rounded}) s->x.push_back(row.alpha);
      quasi.y.push_back(row.quasidefinite.errors(column)), cholesky.y.push_back(row.cholesky.errors(column));
      rounded.y.push_back(row.rounding(column));
    }
    plot.series = {quasi, cholesky, rounded};
    page.plot(plot);
  }
  rows.clear();
  for (const PenaltyStudyRow& row : study.rows) {
    for (const auto& [name, r] : {std::pair<const char*, const PenaltyRun&>{"quasi-definite", row.quasidefinite},
                                  std::pair<const char*, const PenaltyRun&>{"cholesky", row.cholesky}}) {
      rows.push_back({fmt::format("{:.0e}", row.alpha), name, std::to_string(r.statistics.rhs_evaluations),
                      r.ok ? fmt::format("{:.3g}", r.wall_seconds) : "-",
                      r.ok ? error_text(r.statistics.max_position_violation) : "-", r.ok ? "ok" : r.message});
    }
  }
  page.table({"alpha", "solver", "right-hand sides", "time [s]", "drift", "outcome"}, rows);
  add_reference(page, result, study.reference);
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
