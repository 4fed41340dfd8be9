#include <fmt/format.h>

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
#include "app/results/sensor_unit.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

// p dpsi/dp, the change of psi per relative change of p, largest first. A p of zero would hide the derivative.
void add_tornado(HtmlPage& page, const Scene& scene, const std::string& name, const Json& objective) {
  constexpr std::size_t kMost = 15;  // rows of one plot
  RowPlot plot{.title = name + ": what a change of each parameter does",
               .x_label = fmt::format("p dpsi/dp [{}]", unit_of(objective))};
  for (const Parameter& p : scene.parameters) {
    const Json derivative = objective.at("gradient").value(p.name, Json());
    if (!derivative.is_number() || !std::isfinite(derivative.get<double>()) || p.value == 0) continue;
    const double effect = p.value * derivative.get<double>();
    if (effect != 0) plot.rows.push_back({.name = p.name, .low = 0, .high = effect, .words = cell(effect, 4)});
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

// The number of equal digits of two numbers, from their relative difference.
std::optional<double> agreeing_digits(const Json& difference) {
  constexpr double kDouble = 16;  // digits of a double
  if (!difference.is_number() || std::isnan(difference.get<double>())) return std::nullopt;
  return std::clamp(-std::log10(std::max(difference.get<double>(), 1e-300)), 0.0, kDouble);
}

std::vector<double> numbers_of(const Json& array) {
  std::vector<double> numbers;
  for (const Json& x : array) numbers.push_back(x.is_number() ? x.get<double>() : NAN);
  return numbers;
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
    PlotSeries series{name, numbers_of(entry.at("ladder").at("h")), numbers_of(entry.at("ladder").at(key)), Mark::line};
    for (double& y : series.y) y = std::abs(y - derivative);
    if (std::ranges::any_of(series.y, [](double y) { return y > 0; })) plot.series.push_back(std::move(series));
  }
  return plot;
}

// The place of a pair's difference in the page.
std::string ladder_id(std::size_t objective, std::size_t parameter) {
  return fmt::format("ladder-{}-{}", objective, parameter);
}

constexpr std::size_t kMostLadders = 60;  // plots of a page that stays below 400 kB

void add_ladders(HtmlPage& page, const Scene& scene, const Json& result, const Json& entries) {
  page.heading("Differences over their step");
  page.note("Errors fall as h^2 until rounding, or the integrator's error on free steps, takes over as 1/h.");
  page.begin_choices({"objective", "parameter"});
  std::size_t o = 0, plots = 0;
  for (const auto& [objective, parameters] : entries.items()) {
    std::size_t p = 0;
    for (const auto& [parameter, entry] : parameters.items()) {
      const Json& values = result.at("objectives").at(objective);
      const Json derivative = values.at("gradient").value(parameter, Json());
      const auto found = std::ranges::find(scene.parameters, parameter, &Parameter::name);
      if (plots++ < kMostLadders && derivative.is_number() && found != scene.parameters.end()) {
        page.begin_choice({objective, parameter}, ladder_id(o, p));
        page.plot(ladder_plot(objective, unit_of(values), *found, entry, derivative.get<double>()));
        page.end_choice();
      }
      ++p;
    }
    ++o;
  }
  page.end_choices();
  if (plots > kMostLadders) page.note(fmt::format("The first {} of {} plots are drawn.", kMostLadders, plots));
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
    PlotSeries series{slope.is_number() ? fmt::format("{}: h^{:.2f}", objective, slope.get<double>()) : objective,
                      numbers_of(of_one.at("h")), numbers_of(of_one.at("remainder")), Mark::line};
    if (std::ranges::any_of(series.y, [](double y) { return y > 0; })) plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return;
  page.heading("Taylor remainder");
  page.plot(plot);
}

void add_digits(HtmlPage& page, const Json& entries, const char* difference, const std::string& title) {
  constexpr double kDouble = 16;
  std::vector<std::string> header{"objective"};
  std::vector<TableRow> rows;
  bool any = false;
  std::size_t plots = 0;
  for (const auto& [objective, parameters] : entries.items()) {
    TableRow& row = rows.emplace_back(TableRow{objective});
    for (const auto& [parameter, entry] : parameters.items()) {
      if (rows.size() == 1) header.push_back(parameter);
      const std::optional<double> digits = agreeing_digits(entry.at(difference));
      any = any || digits;
      row.push_back(digits ? TableCell(fmt::format("{:.0f}", *digits), cell(entry.at(difference), 3)) : TableCell("-"));
      if (digits) row.back().shade = *digits / kDouble;
      if (digits && plots++ < kMostLadders) row.back().link = "#" + ladder_id(rows.size() - 1, row.size() - 2);
    }
  }
  if (!any) return;
  page.paragraph(title);
  page.table(header, rows);
}

std::string worst(const Json& entries, const char* difference) {
  double largest = 0;
  for (const auto& [objective, parameters] : entries.items())
    for (const auto& [parameter, entry] : parameters.items())
      if (entry.at(difference).is_number() && std::isfinite(entry.at(difference).get<double>()))
        largest = std::max(largest, entry.at(difference).get<double>());
  return fmt::format("{:.1e}", largest);
}

}  // namespace

std::string gradient_report(const Scene& scene, const Json& result) {
  HtmlPage page(report_title(result));
  if (result.contains("objectives")) {
    page.verdict(fmt::format(
        "{} of {} by {}: {}.", counted(static_cast<long>(result.at("objectives").size()), "gradient"),
        counted(static_cast<long>(scene.parameters.size()), "parameter"), result.at("methods").begin().key(), [&] {
          std::string values;
          for (const auto& [name, objective] : result.at("objectives").items())
            values +=
                (values.empty() ? "" : ", ") + name + " = " + cell(objective.at("value"), 5) + after_number(objective);
          return values;
        }()));
  }
  add_status(page, result);
  add_objectives(page, result);
  if (result.contains("objectives")) add_gradients(page, scene, result);
  add_simulation(page, scene, result);
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

std::string check_report(const Scene& scene, const Json& result) {
  HtmlPage page(report_title(result));
  const Json entries = result.value("verdict", Json::object()).value("entries", Json::object());
  if (!entries.empty()) {
    page.verdict(fmt::format(
        "{}: tangent-linear model and adjoint differ by at most {}, differences on frozen steps by {}, "
        "on free steps by {} of an entry.",
        result.at("verdict").at("passed").get<bool>() ? "All gradients agree" : "Gradients disagree",
        worst(entries, "tlm_adjoint"), worst(entries, "frozen_difference"), worst(entries, "free_difference")));
  }
  add_status(page, result);
  if (!entries.empty()) {
    page.heading("Digits that agree");
    page.note(
        "A stronger colour means more agreeing digits, 16 at most. The pointer shows the relative difference; a click "
        "shows the differences over their step.");
    add_digits(page, entries, "tlm_adjoint", "Tangent-linear model and adjoint:");
    add_digits(page, entries, "frozen_difference", "Tangent-linear model and differences on frozen steps:");
    add_digits(page, entries, "free_difference", "Tangent-linear model and differences with step-size control:");
    add_ladders(page, scene, result, entries);
    add_taylor(page, result.at("objectives"), result.at("verdict").value("taylor", Json::object()));
    page.heading("Verdicts");
    std::vector<TableRow> rows;
    for (const auto& [objective, parameters] : entries.items()) {
      const Json& gradient = result.at("objectives").at(objective).at("gradient");
      for (const auto& [parameter, e] : parameters.items())
        rows.push_back({objective, parameter, number_cell(gradient.value(parameter, Json()), 8), cell(e.at("exact")),
                        cell(e.at("frozen")), cell(e.at("free"))});
    }
    page.table({"objective", "parameter", "derivative", "adjoint = tlm", "frozen = tlm", "free = tlm"}, rows);
    add_gradients(page, scene, result);
  }
  add_objectives(page, result);
  add_simulation(page, scene, result);
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
