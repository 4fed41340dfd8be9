// The derivatives of objectives in parameters, as a table and as bars.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/row_plot.hpp"
#include "app/report/run_page.hpp"
#include "app/results/objective_units.hpp"

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

}  // namespace

TextTable gradient_table(const Run& run) {
  const Json& objectives = run.result.at("objectives");
  std::vector<std::string> header{"parameter", "value", "unit"};
  for (const auto& [name, objective] : objectives.items())
    header.push_back(fmt::format("d {} [{} per unit]", name, unit_of(objective)));
  TextTable table(header);
  for (const Parameter& p : run.problem.scene.parameters) {
    TableRow& row = table.add({p.name, number_cell(p.value, 7), p.unit.empty() ? "-" : p.unit});
    for (const Json& objective : objectives)
      row.push_back(number_cell(objective.at("gradient").value(p.name, Json()), 12));
  }
  return table;
}

void add_gradients(RunPage& page) {
  page.heading("Gradients");
  page.table(gradient_table(page.run));
  for (const auto& [name, objective] : page.run.result.at("objectives").items())
    add_tornado(page, page.run.problem.scene, name, objective);
}

}  // namespace mbsopt::inline app
