#include "app/report/motion_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <tuple>
#include <utility>

#include "core/scene/scene_facts.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostNumbers = 20'000;  // of all poses: some 200 kB of the page
constexpr std::size_t kFewestRows = 60;       // fewer rows do not show a smooth motion
constexpr std::size_t kPose = 7;              // x y z e0 e1 e2 e3
constexpr int kTimeDigits = 9;                // 1000.001 s and 1000.002 s are two instants

// Numbers with so many digits; null stands for one that is not finite.
Json rounded(double x, int digits = 6) {
  return std::isfinite(x) ? Json(std::strtod(fmt::format("{:.{}g}", x, digits).c_str(), nullptr)) : Json();
}
Json rounded(const auto& numbers, int digits = 6) {
  Json list = Json::array();
  for (const double x : numbers) list.push_back(rounded(x, digits));
  return list;
}

template <class Items>
Json json_list(const Items& items, const auto& json_of) {
  Json list = Json::array();
  for (const auto& item : items) list.push_back(json_of(item));
  return list;
}

// "b": the body's number, -1 for the ground; "p": the point in its frame.
Json point_json(const SketchPoint& p) {
  return {{"b", p.body == kGround ? -1 : static_cast<long>(p.body)}, {"p", rounded(p.s)}};
}

// Every second, third, ... row, so that at most `most` are left, and the last one.
Trajectory thinned(const Trajectory& all, std::size_t most) {
  Trajectory kept{all.columns, {}};
  const std::size_t stride = (all.rows.size() + most - 1) / most;
  for (std::size_t k = 0; k < all.rows.size(); k += stride) kept.rows.push_back(all.rows[k]);
  if ((all.rows.size() - 1) % stride != 0) kept.rows.push_back(all.rows.back());
  return kept;
}

// A coordinate over time; one number if it is constant.
Json coordinate(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low < 1e-12 ? rounded(values.front()) : rounded(values);
}

// Returns whether the columns of time and poses are finite. A sensor may have no value.
bool poses_are_finite(const MovingState& state) {
  const auto columns = static_cast<std::ptrdiff_t>(1 + 13 * state.scene.bodies.size());
  return std::ranges::all_of(state.trajectory.rows, [&](const std::vector<double>& row) {
    return std::all_of(row.begin(), row.begin() + columns, [](double x) { return std::isfinite(x); });
  });
}

Json target_json(const PointTarget& target) {
  const auto place = [](const std::vector<double>& x) { return x.empty() ? Json() : rounded(x); };
  return {{"measured", target.measured},
          {"at", point_json(target.point)},
          {"t", rounded(target.t, kTimeDigits)},
          {"place", json_list(target.place, place)}};
}

// The size that 98 % of the forces do not exceed; the others, as at singular positions, would hide them. It is 0
// without forces.
double large_force(const Trajectory& forces) {
  constexpr double kShare = 0.98;
  std::vector<double> sizes;
  for (const std::vector<double>& row : forces.rows)
    for (std::size_t k = 1; k + 2 < row.size(); k += 3)
      if (const double size = std::hypot(row[k], row[k + 1], row[k + 2]); std::isfinite(size)) sizes.push_back(size);
  if (sizes.empty()) return 0;
  const auto place = static_cast<std::ptrdiff_t>(std::ceil(kShare * static_cast<double>(sizes.size() - 1)));
  std::nth_element(sizes.begin(), sizes.begin() + place, sizes.end());
  return sizes[static_cast<std::size_t>(place)];
}

// Null without forces.
Json reactions_json(const MovingState& state) {
  const Trajectory& forces = state.forces;
  const double large = large_force(forces);
  if (large == 0) return {};
  Json joints = Json::array();
  for (std::size_t k = 1; k + 2 < forces.columns.size(); k += 3) {
    const std::string name = forces.columns[k].substr(0, forces.columns[k].size() - 2);  // "A.x"
    const auto joint = std::ranges::find(state.scene.joints, name, &Joint::name);
    if (joint == state.scene.joints.end()) continue;
    joints.push_back({{"at", point_json(point_of(state.scene, joint->body2, joint->point2))},
                      {"force", json_list(std::array{k, k + 1, k + 2},
                                          [&](std::size_t column_of) { return rounded(column(forces, column_of)); })}});
  }
  return {{"t", rounded(column(forces, 0), kTimeDigits)}, {"large", rounded(large)}, {"joints", std::move(joints)}};
}

Json points_json(std::vector<Eigen::Vector3d> points) {
  const auto coordinates = [](const Eigen::Vector3d& p) { return std::tuple(p.x(), p.y(), p.z()); };
  std::ranges::sort(points, {}, coordinates);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return json_list(points, [](const Eigen::Vector3d& p) { return rounded(p); });
}

Json state_json(const MovingState& state, std::size_t most) {
  const Sketch sketch = sketch_of(state.scene);
  const Trajectory shown = thinned(state.trajectory, most);
  Json bodies = Json::array();
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    const SketchedBody& body = sketch.bodies[i];
    Json pose = Json::array();
    for (std::size_t k = 0; k < kPose; ++k) pose.push_back(coordinate(column(shown, 1 + 13 * i + k)));
    bodies.push_back({{"name", state.scene.bodies[i].name},
                      {"points", points_json(body.points)},
                      {"hulls", json_list(body.hulls, points_json)},
                      {"solid", body.solid},
                      {"pose", std::move(pose)}});
  }
  const auto optional_point = [](const std::optional<SketchPoint>& p) { return p ? point_json(*p) : Json(); };
  const auto mark_json = [&](const SketchedMark& mark) {
    return Json{{"style", mark.style},
                {"path", mark.path},
                {"at", point_json(mark.at)},
                {"to", optional_point(mark.to)},
                {"axis", optional_point(mark.axis)},
                {"foreshortened", mark.foreshortened},
                {"radius", rounded(mark.radius)}};
  };
  const auto trace_json = [](const TracedPoint& trace) {
    return Json{{"name", trace.name}, {"at", point_json(trace.point)}};
  };
  return {{"name", state.name},
          {"ghost", state.ghost},
          {"t", rounded(column(shown, 0), kTimeDigits)},
          {"bodies", std::move(bodies)},
          {"marks", json_list(sketch.marks, mark_json)},
          {"traces", json_list(sketch.traces, trace_json)},
          {"targets", json_list(state.targets, target_json)},
          {"reactions", reactions_json(state)}};
}

constexpr std::size_t kMostTimes = 200;  // crosses that a reader still tells apart

std::vector<double> every(const std::vector<double>& all, std::size_t stride) {
  std::vector<double> kept;
  for (std::size_t k = 0; k < all.size(); k += stride) kept.push_back(all[k]);
  return kept;
}

}  // namespace

Json motion_scene(const MotionPlane& plane, const std::vector<MovingState>& states) {
  std::size_t bodies = 0, rows = 0;
  for (const MovingState& state : states) {
    if (state.trajectory.rows.size() < 2 || !poses_are_finite(state)) return {};
    bodies += state.scene.bodies.size();
    rows = std::max(rows, state.trajectory.rows.size());
  }
  if (bodies == 0) return {};
  const std::size_t most = std::max(kFewestRows, kMostNumbers / (kPose * bodies));
  const auto g = SceneFacts(states.front().scene).value(states.front().scene.gravity);
  return {{"planar", plane.holds_all},
          {"plane", plane.axes},
          {"gravity", g ? rounded(*g) : Json{0, 0, 0}},
          {"note", rows > most ? fmt::format("The motion shows every {}th of {} rows of trajectory.csv.",
                                             (rows + most - 1) / most, rows)
                               : std::string()},
          {"states", json_list(states, [&](const MovingState& state) { return state_json(state, most); })}};
}

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
