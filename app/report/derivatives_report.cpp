#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/report_parts.hpp"
#include "app/report/row_plot.hpp"
#include "app/report/run_report.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

// p dpsi/dp, the change of psi per relative change of p; largest first. Where p is zero it would hide the derivative.
void add_tornado(HtmlPage& page, const Scene& scene, const std::string& name, const Json& objective) {
  constexpr std::size_t kMost = 15;  // rows of one plot
  RowPlot plot{.title = name + ": what a change of each parameter does", .x_label = "p dpsi/dp [unit of " + name + "]"};
  for (const Parameter& p : scene.parameters) {
    const Json derivative = objective.at("gradient").value(p.name, Json());
    if (!derivative.is_number() || !std::isfinite(derivative.get<double>()) || p.value == 0) continue;
    const double effect = p.value * derivative.get<double>();
    if (effect != 0) plot.rows.push_back({.name = p.name, .low = 0, .high = effect, .words = cell(effect, 4)});
  }
  const auto larger = [](const PlotRow& a, const PlotRow& b) { return std::abs(a.high) > std::abs(b.high); };
  std::stable_sort(plot.rows.begin(), plot.rows.end(), larger);
  if (plot.rows.size() > kMost) plot.rows.resize(kMost);
  page.drawing(to_svg(plot));
}

void add_gradients(HtmlPage& page, const Scene& scene, const Json& result) {
  page.heading("Gradients");
  std::vector<std::string> header{"parameter", "value", "unit"};
  std::vector<TableRow> rows;
  for (const auto& [name, objective] : result.at("objectives").items()) header.push_back("d " + name);
  for (const Parameter& p : scene.parameters) {
    TableRow& row = rows.emplace_back(TableRow{p.name, number_cell(p.value), p.unit.empty() ? "-" : p.unit});
    for (const auto& [name, objective] : result.at("objectives").items())
      row.push_back(number_cell(objective.at("gradient").value(p.name, Json())));
  }
  page.table(header, rows);
  for (const auto& [name, objective] : result.at("objectives").items()) add_tornado(page, scene, name, objective);
}

// Digits to which two numbers agree, from their relative difference.
std::optional<double> agreeing_digits(const Json& difference) {
  constexpr double kDouble = 16;  // digits of a double
  if (!difference.is_number() || std::isnan(difference.get<double>())) return std::nullopt;
  return std::clamp(-std::log10(std::max(difference.get<double>(), 1e-300)), 0.0, kDouble);
}

void add_digits(HtmlPage& page, const Json& entries, const char* difference, const std::string& title) {
  constexpr double kDouble = 16;
  std::vector<std::string> header{"objective"};
  std::vector<TableRow> rows;
  bool any = false;
  for (const auto& [objective, parameters] : entries.items()) {
    TableRow& row = rows.emplace_back(TableRow{objective});
    for (const auto& [parameter, entry] : parameters.items()) {
      if (rows.size() == 1) header.push_back(parameter);
      const std::optional<double> digits = agreeing_digits(entry.at(difference));
      any = any || digits;
      row.push_back(digits ? TableCell(fmt::format("{:.0f}", *digits), cell(entry.at(difference), 3)) : TableCell("-"));
      if (digits) row.back().shade = *digits / kDouble;
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
            values += (values.empty() ? "" : ", ") + name + " = " + cell(objective.at("value"), 5);
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
    page.note("A stronger colour means more agreeing digits, 16 at most. The pointer shows the relative difference.");
    add_digits(page, entries, "tlm_adjoint", "Tangent-linear model and adjoint:");
    add_digits(page, entries, "frozen_difference", "Tangent-linear model and differences on frozen steps:");
    add_digits(page, entries, "free_difference", "Tangent-linear model and differences with step-size control:");
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
