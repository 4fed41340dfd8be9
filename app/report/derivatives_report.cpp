#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/row_plot.hpp"
#include "app/report/run_report.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

// p dpsi/dp, the change of psi per relative change of p, largest first. A p of zero would hide the derivative.
void add_tornado(HtmlPage& page, const Scene& scene, const std::string& name, const Json& objective) {
  constexpr std::size_t kMost = 15;  // rows of one plot
  RowPlot plot{.title = name + ": what a change of each parameter does",
               .x_label = fmt::format("p dpsi/dp [{}]", unit_of(objective))};
  for (const Parameter& p : scene.parameters) {
    const double effect = p.value * number_of(objective.at("gradient"), p.name);
    if (std::isfinite(effect) && effect != 0)
      plot.rows.push_back({.name = p.name, .low = 0, .high = effect, .words = cell(effect, 4)});
  }
  const auto larger = [](const PlotRow& a, const PlotRow& b) { return std::abs(a.high) > std::abs(b.high); };
  std::stable_sort(plot.rows.begin(), plot.rows.end(), larger);
  const std::size_t all = plot.rows.size();
  if (all > kMost) plot.rows.resize(kMost);
  page.drawing(to_svg(plot));
  if (all > kMost) page.note(fmt::format("The {} largest of {} are drawn.", kMost, all));
}

void add_gradients(HtmlPage& page, const Scene& scene, const Json& result) {
  page.heading("Gradients");
  std::vector<std::string> header{"parameter", "value", "unit"};
  std::vector<TableRow> rows;
  for (const auto& [name, objective] : result.at("objectives").items())
    header.push_back(fmt::format("d {} [{} per unit]", name, unit_of(objective)));
  for (const Parameter& p : scene.parameters) {
    TableRow& row = rows.emplace_back(TableRow{p.name, number_cell(p.value), p.unit.empty() ? "-" : p.unit});
    for (const auto& [name, objective] : result.at("objectives").items())
      row.push_back(number_cell(objective.at("gradient").value(p.name, Json())));
  }
  page.table(header, rows);
  for (const auto& [name, objective] : result.at("objectives").items()) add_tornado(page, scene, name, objective);
}

std::vector<double> numbers_of(const Json& array) {
  std::vector<double> numbers;
  for (const Json& x : array) numbers.push_back(x.is_number() ? x.get<double>() : NAN);
  return numbers;
}

// Adds the series if a logarithmic axis can show any of it.
void add_positive(LinePlot& plot, PlotSeries series) {
  if (std::ranges::any_of(series.y, [](double y) { return y > 0; })) plot.series.push_back(std::move(series));
}

// |central difference - tangent-linear model| over the step h, per kind of steps.
LinePlot ladder_plot(const std::string& objective, const std::string& unit, const Parameter& parameter,
                     const Json& entry, double derivative) {
  const std::string step = parameter.unit.empty() ? kUnknownUnit : parameter.unit;
  LinePlot plot{.title = fmt::format("d {}/d {}: differences over their step", objective, parameter.name),
                .x_label = fmt::format("step h of {} [{}]", parameter.name, step),
                .y_label = fmt::format("|difference - derivative| [{}]", unit_per(unit, step)),
                .logarithmic_y = true,
                .logarithmic_x = true};
  for (const auto& [key, name] :
       {std::pair("frozen", "on frozen steps"), std::pair("free", "with step-size control")}) {
    std::vector<double> errors = numbers_of(entry.at("ladder").at(key));
    for (double& y : errors) y = std::abs(y - derivative);
    add_positive(plot, {name, numbers_of(entry.at("ladder").at("h")), errors});
  }
  return plot;
}

constexpr std::size_t kMostLadders = 60;  // plots of a page that stays below 400 kB

// The entry of result["verdict"]["entries"] for one objective and one parameter.
struct CheckedPair {
  std::string objective, parameter;
  const Json& entry;
};

std::string ladder_id(std::size_t pair) { return fmt::format("ladder-{}", pair); }  // for links

void add_ladders(HtmlPage& page, const Scene& scene, const Json& result, const std::vector<CheckedPair>& pairs) {
  page.heading("Differences over their step");
  page.note("Errors fall as h^2 until rounding, or the integrator's error on free steps, takes over as 1/h.");
  page.begin_choices({"objective", "parameter"});
  for (std::size_t k = 0; k < std::min(pairs.size(), kMostLadders); ++k) {
    const auto& [objective, parameter, entry] = pairs[k];
    const Json& values = result.at("objectives").at(objective);
    const double derivative = number_of(values.at("gradient"), parameter);
    const auto found = std::ranges::find(scene.parameters, parameter, &Parameter::name);
    if (std::isnan(derivative) || found == scene.parameters.end()) continue;
    page.begin_choice({objective, parameter}, ladder_id(k));
    page.plot(ladder_plot(objective, unit_of(values), *found, entry, derivative));
    page.end_choice();
  }
  page.end_choices();
  if (pairs.size() > kMostLadders)
    page.note(fmt::format("The first {} of {} plots are drawn.", kMostLadders, pairs.size()));
}

void add_taylor(HtmlPage& page, const Json& objectives, const Json& taylor) {
  std::set<std::string> units;
  for (const auto& [objective, of_one] : taylor.items()) units.insert(unit_of(objectives.at(objective)));
  LinePlot plot{.title = "Taylor remainder along a random direction d of all parameters",
                .x_label = "h [-]",
                .y_label = fmt::format("|psi(rho + h d) - psi - h psi_rho d| [{}]",
                                       units.size() == 1 ? *units.begin() : kUnknownUnit),
                .logarithmic_y = true,
                .logarithmic_x = true};
  for (const auto& [objective, of_one] : taylor.items()) {
    const Json slope = of_one.value("slope", Json());
    add_positive(plot, {slope.is_number() ? fmt::format("{}: h^{:.2f}", objective, slope.get<double>()) : objective,
                        numbers_of(of_one.at("h")), numbers_of(of_one.at("remainder"))});
  }
  if (plot.series.empty()) return;
  page.heading("Taylor remainder");
  page.plot(plot);
}

// The number of equal digits of two numbers, from their relative difference.
void add_digits(HtmlPage& page, const std::vector<CheckedPair>& pairs, const char* difference,
                const std::string& title) {
  constexpr double kDouble = 16;  // digits of a double
  std::vector<std::string> header{"objective"};
  std::vector<TableRow> rows;
  bool any = false;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto& [objective, parameter, entry] = pairs[k];
    if (rows.empty() || rows.back().front().text != objective) rows.push_back({objective});
    if (rows.size() == 1) header.push_back(parameter);
    TableCell& shown = rows.back().emplace_back("-");
    const double found = number_of(entry, difference);
    if (std::isnan(found)) continue;
    const double digits = std::clamp(-std::log10(std::max(found, 1e-300)), 0.0, kDouble);
    any = true;
    shown = TableCell(fmt::format("{:.0f}", digits), cell(found, 3));
    shown.shade = digits / kDouble;
    if (k < kMostLadders) shown.link = "#" + ladder_id(k);
  }
  if (!any) return;
  page.paragraph(title);
  page.table(header, rows);
}

std::string worst(const std::vector<CheckedPair>& pairs, const char* difference) {
  double largest = 0;
  for (const CheckedPair& pair : pairs)
    if (const double found = number_of(pair.entry, difference); std::isfinite(found))
      largest = std::max(largest, found);
  return fmt::format("{:.1e}", largest);
}

}  // namespace

std::string gradient_report(const Scene& scene, const Json& result) {
  HtmlPage page(report_title(result));
  if (result.contains("objectives")) {
    page.verdict(
        fmt::format("{} of {} by {}: {}.", counted(static_cast<long>(result.at("objectives").size()), "gradient"),
                    counted(static_cast<long>(scene.parameters.size()), "parameter"),
                    result.at("methods").begin().key(), fmt::join(objective_values(result.at("objectives")), ", ")));
  }
  add_status(page, result);
  add_objectives(page, result);
  if (result.contains("objectives")) add_gradients(page, scene, result);
  add_simulation(page, scene, result);
  return finished(page, result);
}

std::string check_report(const Scene& scene, const Json& result) {
  HtmlPage page(report_title(result));
  const Json entries = result.value("verdict", Json::object()).value("entries", Json::object());
  std::vector<CheckedPair> pairs;
  for (const auto& [objective, parameters] : entries.items())
    for (const auto& [parameter, entry] : parameters.items()) pairs.push_back({objective, parameter, entry});
  if (!pairs.empty()) {
    page.verdict(
        fmt::format("{}: tangent-linear model and adjoint differ by at most {}, differences on frozen steps by {}, "
                    "on free steps by {} of an entry.",
                    result.at("verdict").at("passed").get<bool>() ? "All gradients agree" : "Gradients disagree",
                    worst(pairs, "tlm_adjoint"), worst(pairs, "frozen_difference"), worst(pairs, "free_difference")));
  }
  add_status(page, result);
  if (!pairs.empty()) {
    page.heading("Digits that agree");
    page.note(
        "A stronger colour means more agreeing digits, 16 at most. The pointer shows the relative difference; a click "
        "shows the differences over their step.");
    add_digits(page, pairs, "tlm_adjoint", "Tangent-linear model and adjoint:");
    add_digits(page, pairs, "frozen_difference", "Tangent-linear model and differences on frozen steps:");
    add_digits(page, pairs, "free_difference", "Tangent-linear model and differences with step-size control:");
    add_ladders(page, scene, result, pairs);
    add_taylor(page, result.at("objectives"), result.at("verdict").value("taylor", Json::object()));
    page.heading("Verdicts");
    std::vector<TableRow> rows;
    for (const auto& [objective, parameter, e] : pairs) {
      const Json& gradient = result.at("objectives").at(objective).at("gradient");
      rows.push_back({objective, parameter, number_cell(gradient.value(parameter, Json()), 8), cell(e.at("exact")),
                      cell(e.at("frozen")), cell(e.at("free"))});
    }
    page.table({"objective", "parameter", "derivative", "adjoint = tlm", "frozen = tlm", "free = tlm"}, rows);
    add_gradients(page, scene, result);
  }
  add_objectives(page, result);
  add_simulation(page, scene, result);
  return finished(page, result);
}

}  // namespace mbsopt::inline app
