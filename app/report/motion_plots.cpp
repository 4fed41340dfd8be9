#include "app/report/motion_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/results/sensor_unit.hpp"

namespace mbsopt {
namespace {

constexpr std::size_t kMostSeries = 6;  // in one plot

std::vector<double> column(const Trajectory& trajectory, std::size_t index) {
  std::vector<double> values;
  values.reserve(trajectory.rows.size());
  for (const auto& row : trajectory.rows) values.push_back(row[index]);
  return values;
}

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

void add_series(LinePlot& plot, const SensorGroup& group, const Trajectory& trajectory, const std::string& suffix,
                Mark mark) {
  if (trajectory.rows.empty()) return;  // the run failed before its first row, or was interrupted
  for (const std::size_t index : group.second) {
    plot.series.push_back({trajectory.columns[index] + suffix, column(trajectory, 0), column(trajectory, index), mark});
  }
}

std::vector<SensorGroup> groups_of(const Scene& scene, const Trajectory& trajectory) {
  if (trajectory.rows.empty()) return {};
  return scene.sensors.empty() ? position_groups(scene, trajectory) : sensor_groups(scene);
}

std::string title_of(const SensorGroup& group, const Trajectory& trajectory) {
  return group.second.size() == 1 ? trajectory.columns[group.second.front()] : group.first;
}

}  // namespace

std::vector<LinePlot> motion_plots(const Scene& scene, const Trajectory& trajectory) {
  std::vector<LinePlot> plots;
  for (const SensorGroup& group : groups_of(scene, trajectory)) {
    LinePlot plot{.title = title_of(group, trajectory), .x_label = "t [s]", .y_label = group.first};
    add_series(plot, group, trajectory, "", Mark::line);
    plots.push_back(std::move(plot));
  }
  return plots;
}

std::vector<LinePlot> motion_plots(const Scene& scene, const Trajectory& before, const Trajectory& after,
                                   const SensorLimits& limits) {
  std::vector<LinePlot> plots;
  for (const SensorGroup& group : groups_of(scene, before)) {
    for (const std::size_t index : group.second) {
      const SensorGroup alone{group.first, {index}};
      LinePlot plot{.title = before.columns[index], .x_label = "t [s]", .y_label = group.first};
      add_series(plot, alone, before, ", before", Mark::dashed);
      add_series(plot, alone, after, ", after", Mark::line);
      for (const auto& [sensor, limit] : limits)
        if (sensor == before.columns[index]) plot.limits.push_back(limit);
      plots.push_back(std::move(plot));
    }
  }
  return plots;
}

}  // namespace mbsopt
