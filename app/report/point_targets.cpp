#include "app/report/point_targets.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostTimes = 200;  // crosses that a reader still tells apart

std::vector<double> every(const std::vector<double>& all, std::size_t stride) {
  std::vector<double> kept;
  for (std::size_t k = 0; k < all.size(); k += stride) kept.push_back(all[k]);
  return kept;
}

}  // namespace

std::vector<PointTarget> point_targets(const Scene& scene, const std::vector<SensorValues>& values, bool measured) {
  std::vector<PointTarget> targets;
  for (const SensorValues& v : values) {
    const auto sensor = std::ranges::find(scene.sensors, v.sensor, &Sensor::name);
    if (sensor == scene.sensors.end() || sensor->quantity != "position" || sensor->relative_to ||
        sensor->in_body_frame || v.t.empty())
      continue;
    const std::size_t axis = std::string_view("xyz").find(sensor->component);
    if (sensor->component.size() != 1 || axis > 2) continue;
    const SketchPoint point = point_of(scene, sensor->body, sensor->point);
    const std::size_t stride = (v.t.size() + kMostTimes - 1) / kMostTimes;
    const std::vector<double> t = every(v.t, stride);
    auto target = std::ranges::find_if(targets, [&](const PointTarget& other) {
      return other.point == point && other.t == t && other.place[axis].empty();
    });
    if (target == targets.end()) target = targets.insert(targets.end(), {point, measured, t});
    target->place[axis] = every(v.value, stride);
  }
  return targets;
}

std::vector<PointTarget> prescribed_points(const Problem& problem, const std::vector<std::vector<double>>& instants) {
  const SimulationSettings& settings = problem.scene.simulation;
  std::vector<SensorValues> values;
  for (std::size_t i = 0; i < problem.objectives.size(); ++i) {
    std::map<std::tuple<std::string, bool, double>, std::size_t> points;  // as FreeInstants numbers them
    for (const TrackTerm& term : problem.objectives[i].track) {
      if (!term.curve) continue;
      std::vector<std::pair<double, double>> rows;  // time, value
      for (std::size_t k = 0; k < term.curve->x().size(); ++k) {
        double t = term.curve->x()[k];
        if (term.timing != Timing::prescribed) {
          const std::tuple key(term.file, term.timing == Timing::ordered, t);
          const std::size_t point = points.emplace(key, points.size()).first->second;
          t = i < instants.size() && point < instants[i].size() ? instants[i][point] : INFINITY;
        }
        if (t >= settings.start_time && t <= settings.end_time) rows.emplace_back(t, term.curve->y()[k]);
      }
      std::ranges::stable_sort(rows, {}, &std::pair<double, double>::first);
      SensorValues& v = values.emplace_back(SensorValues{term.sensor, {}, {}});
      for (const auto& [t, value] : rows) {
        v.t.push_back(t);
        v.value.push_back(value);
      }
    }
  }
  return point_targets(problem.scene, values, false);
}

}  // namespace mbsopt::inline app
