// A motion on the page: the moving mechanism, plots over time, extremes of sensors.
#include <fmt/format.h>

#include <algorithm>

#include "app/report/run_page.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostSeries = 6;  // in one plot

// The plots of a trajectory, without its rows: labels of the axes, and columns. Sensors are grouped by unit.
using Groups = std::vector<std::pair<std::string, std::vector<std::size_t>>>;

Groups sensor_groups(const Scene& scene) {
  Groups groups;
  for (std::size_t i = 0; i < scene.sensors.size(); ++i) {
    const Sensor& sensor = scene.sensors[i];
    const std::string unit = unit_in(scene, sensor);
    const std::string label = unit.empty() ? sensor.quantity : fmt::format("{} [{}]", sensor.quantity, unit);
    auto group = std::find_if(groups.rbegin(), groups.rend(), [&](const auto& g) { return g.first == label; });
    if (group == groups.rend() || group->second.size() == kMostSeries) {
      groups.push_back({label, {}});
      group = groups.rbegin();
    }
    group->second.push_back(sensor_column(scene, i));
  }
  return groups;
}

// For scenes without sensors.
Groups position_groups(const Scene& scene, const Trajectory& trajectory) {
  Groups groups;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::size_t> columns;
    for (std::size_t body = 0; body < std::min(scene.bodies.size(), kMostSeries); ++body) {
      const std::vector<double> values = column(trajectory, 1 + 13 * body + axis);
      const auto [low, high] = std::ranges::minmax(values);
      if (high - low > 1e-9) columns.push_back(1 + 13 * body + axis);  // [m]; what rests says nothing
    }
    if (!columns.empty()) groups.emplace_back(fmt::format("{} [m]", "xyz"[axis]), columns);
  }
  return groups;
}

std::vector<LinePlot> motion_plots(const Scene& scene, const Trajectory& trajectory) {
  std::vector<LinePlot> plots;
  if (trajectory.rows.empty()) return plots;  // the run failed before its first row, or was interrupted
  for (const auto& [label, indices] :
       scene.sensors.empty() ? position_groups(scene, trajectory) : sensor_groups(scene)) {
    LinePlot& plot = plots.emplace_back(LinePlot{.title = label, .x_label = "t [s]", .y_label = label});
    if (indices.size() == 1) plot.title = trajectory.columns[indices.front()];
    for (const std::size_t index : indices)
      plot.series.push_back({trajectory.columns[index], column(trajectory, 0), column(trajectory, index)});
  }
  return plots;
}

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
  for (std::size_t i = 0; i < scene.sensors.size(); ++i) {
    const auto value = [k = sensor_column(scene, i)](const auto& row) { return row[k]; };
    const auto [low, high] = std::ranges::minmax_element(trajectory.rows, {}, value);
    rows.push_back({scene.sensors[i].name, unit_in(scene, scene.sensors[i]), number_cell(value(*low), 5),
                    number_cell(low->front(), 4), number_cell(value(*high), 5), number_cell(high->front(), 4),
                    number_cell(value(trajectory.rows.back()), 5)});
  }
  page.heading("Sensors");
  page.table({"sensor", "unit", "least", "at t [s]", "largest", "at t [s]", "at the end"}, rows);
}

void add_efforts(HtmlPage& page, const Scene& scene, const Trajectory& efforts,
                 const std::vector<PlotInstant>& instants) {
  for (std::size_t k = 0; k < scene.drives.size() && !efforts.rows.empty(); ++k) {
    const std::string &name = scene.drives[k].name, unit = unit_of_effort(scene.drives[k]);
    page.plot({.title = (unit == "N" ? "Force of " : "Torque of ") + name,
               .x_label = "t [s]",
               .y_label = fmt::format("{} [{}]", unit == "N" ? "force" : "torque", unit),
               .series = {{name, column(efforts, 0), column(efforts, 1 + k)}},
               .instants = instants});
  }
}

}  // namespace

void add_motion(HtmlPage& page, const std::vector<MovingState>& states) {
  if (std::ranges::any_of(states, [](const MovingState& state) { return state.trajectory.rows.empty(); })) return;
  const MovingState& last = states.back();
  const MotionPlane plane = plane_of_motion(last.scene, last.trajectory);
  const bool alone = states.size() == 1;  // then one drawing shows both ends
  std::vector<DrawnState> starts, ends;
  for (const MovingState& state : states) {
    starts.push_back({alone ? "start" : state.name, state.scene, state.trajectory.rows.front()});
    (alone ? starts : ends).push_back({alone ? "end" : state.name, state.scene, state.trajectory.rows.back()});
  }
  const std::string stills =
      mechanism_drawing(alone ? "The mechanism at start and end" : "At the start", plane.axes, starts) +
      mechanism_drawing("At the end", plane.axes, ends);
  Json motion = motion_scene(plane, states);
  motion.is_null() ? page.drawing(stills) : page.motion(std::move(motion), stills);
}

void add_compared_motions(HtmlPage& page, const Scene& scene, const Trajectory& before, const Trajectory& after,
                          const SensorLimits& limits) {
  for (const LinePlot& group : motion_plots(scene, before)) {
    for (const PlotSeries& series : group.series) {
      LinePlot plot{.title = series.name, .x_label = "t [s]", .y_label = group.y_label};
      plot.series.push_back({series.name + ", before", series.x, series.y, Mark::dashed});
      if (const auto designed = series_of(after, series.name))
        plot.series.push_back({series.name + ", after", designed->x, designed->y});
      for (const auto& [sensor, limit] : limits)
        if (sensor == series.name) plot.limits.push_back(limit);
      page.plot(plot);
    }
  }
}

void add_simulated_motion(RunPage& page, const Scene& scene, const RecordedMotion& motion,
                          const std::vector<PointTarget>& targets, const std::vector<PlotInstant>& instants) {
  const Trajectory& trajectory = motion.trajectory;
  add_motion_verdict(page, page.run.result, trajectory);
  add_objectives(page);
  page.heading("Motion");
  add_motion(page, {{scene.name, scene, trajectory, false, targets, motion.forces}});
  for (LinePlot& plot : motion_plots(scene, trajectory)) {
    plot.instants = instants;
    page.plot(plot);
  }
  add_efforts(page, scene, motion.efforts, instants);
  add_extremes(page, scene, trajectory);
  add_simulation(page, scene);
}

}  // namespace mbsopt::inline app
