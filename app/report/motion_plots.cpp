#include "app/report/motion_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/results/objective_units.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostSeries = 6;  // in one plot

// The content of one plot: its label, and the trajectory's columns.
using SensorGroup = std::pair<std::string, std::vector<std::size_t>>;

std::vector<SensorGroup> sensor_groups(const Scene& scene) {
  const std::size_t first = 1 + 13 * scene.bodies.size();
  std::vector<SensorGroup> groups;
  for (std::size_t i = 0; i < scene.sensors.size(); ++i) {
    const Sensor& sensor = scene.sensors[i];
    const std::string unit = unit_in(scene, sensor);
    const std::string label = unit.empty() ? sensor.quantity : fmt::format("{} [{}]", sensor.quantity, unit);
    auto group = std::find_if(groups.rbegin(), groups.rend(), [&](const SensorGroup& g) { return g.first == label; });
    if (group == groups.rend() || group->second.size() == kMostSeries) {
      groups.push_back({label, {}});
      group = groups.rbegin();
    }
    group->second.push_back(first + i);
  }
  return groups;
}

std::vector<SensorGroup> position_groups(const Scene& scene, const Trajectory& trajectory) {
  std::vector<SensorGroup> groups;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    SensorGroup group{fmt::format("{} [m]", "xyz"[axis]), {}};
    for (std::size_t body = 0; body < std::min(scene.bodies.size(), kMostSeries); ++body) {
      const std::vector<double> values = column(trajectory, 1 + 13 * body + axis);
      const auto [low, high] = std::minmax_element(values.begin(), values.end());
      if (*high - *low > 1e-9) group.second.push_back(1 + 13 * body + axis);  // [m]; what rests says nothing
    }
    if (!group.second.empty()) groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace

std::vector<double> column(const Trajectory& table, std::size_t index) {
  std::vector<double> values;
  values.reserve(table.rows.size());
  for (const auto& row : table.rows) values.push_back(row[index]);
  return values;
}

std::optional<PlotSeries> series_of(const Trajectory& table, const std::string& name, Mark mark) {
  const auto found = std::ranges::find(table.columns, name);
  if (found == table.columns.end() || table.rows.empty()) return std::nullopt;
  return PlotSeries{name, column(table, 0), column(table, static_cast<std::size_t>(found - table.columns.begin())),
                    mark};
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

std::vector<LinePlot> motion_plots(const Scene& scene, const Trajectory& before, const Trajectory& after,
                                   const SensorLimits& limits) {
  std::vector<LinePlot> plots;
  for (const LinePlot& group : motion_plots(scene, before)) {
    for (const PlotSeries& series : group.series) {
      LinePlot& plot = plots.emplace_back(LinePlot{.title = series.name, .x_label = "t [s]", .y_label = group.y_label});
      plot.series.push_back({series.name + ", before", series.x, series.y, Mark::dashed});
      if (const auto designed = series_of(after, series.name))
        plot.series.push_back({series.name + ", after", designed->x, designed->y});
      for (const auto& [sensor, limit] : limits)
        if (sensor == series.name) plot.limits.push_back(limit);
    }
  }
  return plots;
}

}  // namespace mbsopt::inline app
