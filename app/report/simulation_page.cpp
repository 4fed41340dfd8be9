#include <fmt/format.h>

#include <algorithm>

#include "app/report/run_page.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

// "5 s of motion in 312 steps; constraints hold within 2.1e-11; track = 1.234."
void add_motion_verdict(HtmlPage& page, const Json& result, const Trajectory& trajectory) {
  if (trajectory.rows.empty() || !result.contains("simulation")) return;
  const Json& simulation = result.at("simulation");
  std::string words = fmt::format("{:.6g} s of motion in {}; the constraints hold within {}",
                                  trajectory.rows.back().front() - trajectory.rows.front().front(),
                                  counted(simulation.at("steps").get<long>(), "step"),
                                  cell(simulation.at("max_position_violation"), 2));
  constexpr std::size_t kMost = 3;  // objectives in a sentence
  const std::vector<std::string> values = objective_values(result.value("objectives", Json::object()));
  if (values.size() <= kMost)
    for (const std::string& value : values) words += "; " + value;
  page.verdict(words + ".");
}

// The least and largest value of each sensor, with their times.
void add_extremes(HtmlPage& page, const Scene& scene, const Trajectory& trajectory) {
  if (scene.sensors.empty() || trajectory.rows.empty()) return;
  std::vector<TableRow> rows;
  const std::size_t first = 1 + 13 * scene.bodies.size();
  for (std::size_t i = 0; i < scene.sensors.size(); ++i) {
    const auto less = [&](const auto& a, const auto& b) { return a[first + i] < b[first + i]; };
    const auto [low, high] = std::minmax_element(trajectory.rows.begin(), trajectory.rows.end(), less);
    rows.push_back({scene.sensors[i].name, unit_in(scene, scene.sensors[i]), number_cell((*low)[first + i], 5),
                    number_cell(low->front(), 4), number_cell((*high)[first + i], 5), number_cell(high->front(), 4),
                    number_cell(trajectory.rows.back()[first + i], 5)});
  }
  page.heading("Sensors");
  page.table({"sensor", "unit", "least", "at t [s]", "largest", "at t [s]", "at the end"}, rows);
}

void add_efforts(HtmlPage& page, const Scene& scene, const MotionParts& parts) {
  const Trajectory& efforts = parts.efforts;
  if (efforts.rows.empty()) return;
  for (std::size_t k = 1; k < efforts.columns.size(); ++k) {
    const auto drive = std::ranges::find(scene.drives, efforts.columns[k], &Drive::name);
    const std::string unit = drive == scene.drives.end() ? "N or N m" : unit_of_effort(*drive);
    page.plot({.title = (unit == "N" ? "Force of " : "Torque of ") + efforts.columns[k],
               .x_label = "t [s]",
               .y_label = fmt::format("{} [{}]", unit == "N" ? "force" : "torque", unit),
               .series = {{efforts.columns[k], column(efforts, 0), column(efforts, k)}},
               .instants = parts.instants});
  }
}

}  // namespace

void add_simulated_motion(RunPage& page, const Scene& scene, const Trajectory& trajectory, const MotionParts& parts) {
  add_motion_verdict(page, page.run.result, trajectory);
  add_objectives(page);
  page.heading("Motion");
  add_motion(page, {{scene.name, scene, trajectory, false, parts.targets, parts.forces}});
  for (LinePlot& plot : motion_plots(scene, trajectory)) {
    plot.instants = parts.instants;
    page.plot(plot);
  }
  add_efforts(page, scene, parts);
  add_extremes(page, scene, trajectory);
  add_simulation(page, scene);
}

}  // namespace mbsopt::inline app
