#include "app/report/motion_scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/report/html_text.hpp"
#include "app/report/mechanism_sketch.hpp"
#include "app/report/motion_plots.hpp"
#include "core/scene/scene_facts.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostNumbers = 20'000;  // of all poses: some 200 kB of the page
constexpr std::size_t kFewestRows = 60;       // fewer rows do not show a smooth motion
constexpr std::size_t kPose = 7;              // x y z e0 e1 e2 e3

std::string vector_of(const Eigen::Vector3d& v) { return fmt::format("[{:.6g},{:.6g},{:.6g}]", v.x(), v.y(), v.z()); }

// "b": the body's number, -1 for the ground; "p": the point in its frame. end: "", or "1" and "2".
std::string point_json(const SketchPoint& p, const char* end = "") {
  return fmt::format(R"("b{0}":{1},"p{0}":{2})", end, p.body == kGround ? -1 : static_cast<long>(p.body),
                     vector_of(p.s));
}

// Every second, third, ... row, so that at most `most` are left, and the last one.
Trajectory thinned(const Trajectory& all, std::size_t most) {
  Trajectory kept{all.columns, {}};
  const std::size_t stride = (all.rows.size() + most - 1) / most;
  for (std::size_t k = 0; k < all.rows.size(); k += stride) kept.rows.push_back(all.rows[k]);
  if ((all.rows.size() - 1) % stride != 0) kept.rows.push_back(all.rows.back());
  return kept;
}

// A constant coordinate is a number; another one is the number of its array in brackets.
std::string coordinate(PageArrays& arrays, const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (*high - *low < 1e-12) return fmt::format("{:.6g}", values.front());
  return fmt::format("[{}]", arrays.add(values));
}

// Returns whether the columns of time and poses are finite. A sensor may have no value.
bool poses_are_finite(const MovingState& state) {
  const auto columns = static_cast<std::ptrdiff_t>(1 + 13 * state.scene.bodies.size());
  return std::ranges::all_of(state.trajectory.rows, [&](const std::vector<double>& row) {
    return std::all_of(row.begin(), row.begin() + columns, [](double x) { return std::isfinite(x); });
  });
}

std::string targets_json(PageArrays& arrays, const std::vector<PointTarget>& targets) {
  return json_list(targets, [&](const PointTarget& target) {
    const std::string place = json_list(target.place, [&](const std::vector<double>& x) {
      return x.empty() ? std::string("null") : std::to_string(arrays.add(x));
    });
    return fmt::format(R"({{"measured":{},{},"t":{},"place":{}}})", target.measured, point_json(target.point),
                       arrays.add(target.t, 9), place);
  });
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

// Writes null without forces.
std::string reactions_json(PageArrays& arrays, const MovingState& state) {
  const Trajectory& forces = state.forces;
  const double large = large_force(forces);
  if (large == 0) return "null";
  std::vector<std::string> joints;
  for (std::size_t k = 1; k + 2 < forces.columns.size(); k += 3) {
    const std::string name = forces.columns[k].substr(0, forces.columns[k].size() - 2);  // "A.x"
    const auto joint = std::ranges::find(state.scene.joints, name, &Joint::name);
    if (joint == state.scene.joints.end()) continue;
    joints.push_back(fmt::format(
        R"({{{},"force":[{},{},{}]}})", point_json(point_of(state.scene, joint->body2, joint->point2)),
        arrays.add(column(forces, k)), arrays.add(column(forces, k + 1)), arrays.add(column(forces, k + 2))));
  }
  return fmt::format(R"({{"t":{},"large":{:.6g},"joints":[{}]}})", arrays.add(column(forces, 0), 9), large,
                     fmt::join(joints, ","));
}

std::string state_json(PageArrays& arrays, const MovingState& state, std::size_t most) {
  const Sketch sketch = sketch_of(state.scene);
  const Trajectory shown = thinned(state.trajectory, most);
  std::vector<std::string> bodies;
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    std::vector<std::string> points, shapes, row;
    for (const Eigen::Vector3d& s : sketch.bodies[i]) points.push_back(vector_of(s));
    for (const SketchedShape& shape : sketch.shapes)
      if (shape.body == i)
        shapes.push_back(fmt::format(R"({{"type":{},"from":{},"to":{},"radius":{:.6g}}})", json_quoted(shape.type),
                                     vector_of(shape.from), vector_of(shape.to), shape.radius));
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    for (std::size_t k = 0; k < kPose; ++k) row.push_back(coordinate(arrays, column(shown, 1 + 13 * i + k)));
    bodies.push_back(fmt::format(R"({{"name":{},"points":[{}],"shapes":[{}],"row":[{}]}})",
                                 json_quoted(state.scene.bodies[i].name), fmt::join(points, ","),
                                 fmt::join(shapes, ","), fmt::join(row, ",")));
  }
  const auto joint_json = [](const SketchedJoint& joint) {
    return fmt::format(R"({{"type":{},{},{},"axis":{}}})", json_quoted(joint.type), point_json(joint.on_body1, "1"),
                       point_json(joint.on_body2, "2"), joint.axis ? vector_of(*joint.axis) : "null");
  };
  const auto spring_json = [](const SketchedSpring& spring) {
    return fmt::format(R"({{{},{},"spring":{},"damper":{}}})", point_json(spring.from, "1"), point_json(spring.to, "2"),
                       spring.spring, spring.damper);
  };
  const auto trace_json = [](const TracedPoint& trace) {
    return fmt::format(R"({{"name":{},{}}})", json_quoted(trace.name), point_json(trace.point));
  };
  return fmt::format(
      R"({{"name":{},"ghost":{},"t":{},"bodies":[{}],"joints":{},"springs":{},"traces":{},"targets":{},"reactions":{}}})",
      json_quoted(state.name), state.ghost, arrays.add(column(shown, 0), 9), fmt::join(bodies, ","),
      json_list(sketch.joints, joint_json), json_list(sketch.springs, spring_json),
      json_list(sketch.traces, trace_json), targets_json(arrays, state.targets), reactions_json(arrays, state));
}

// Returns whether all points stay in planes of that normal.
bool moves_in(std::array<int, 2> plane, const Scene& scene, const Trajectory& trajectory) {
  constexpr double kStandstill = 1e-6;  // [m] per metre of the largest distance
  const auto normal = static_cast<std::size_t>(3 - plane[0] - plane[1]);
  double leaves = 0, largest = 1e-3;
  for (const std::vector<double>& row : trajectory.rows) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const double *const now = row.data() + 1 + 13 * i, *const first = trajectory.rows.front().data() + 1 + 13 * i;
      for (std::size_t k = 0; k < 3; ++k) largest = std::max(largest, std::abs(now[k]));
      leaves = std::max({leaves, std::abs(now[normal] - first[normal])});
      for (std::size_t k = 0; k < 3; ++k)  // the angular velocity points along the normal
        if (k != normal && std::abs(now[10 + k]) > 1e-6 * (1 + std::abs(now[10 + normal]))) return false;
    }
  }
  return leaves <= kStandstill * largest;
}

}  // namespace

std::string motion_scene(PageArrays& arrays, std::array<int, 2> plane, const std::vector<MovingState>& states) {
  std::size_t bodies = 0, rows = 0;
  for (const MovingState& state : states) {
    if (state.trajectory.rows.size() < 2 || !poses_are_finite(state)) return {};
    bodies += state.scene.bodies.size();
    rows = std::max(rows, state.trajectory.rows.size());
  }
  if (bodies == 0) return {};
  const std::size_t most = std::max(kFewestRows, kMostNumbers / (kPose * bodies));
  std::vector<std::string> parts;
  bool planar = true;
  for (const MovingState& state : states) {
    parts.push_back(state_json(arrays, state, most));
    planar = planar && moves_in(plane, state.scene, state.trajectory);
  }
  const auto g = SceneFacts(states.front().scene).value(states.front().scene.gravity);
  const std::string note = rows > most ? fmt::format("The motion shows every {}th of {} rows of trajectory.csv.",
                                                     (rows + most - 1) / most, rows)
                                       : std::string();
  return fmt::format(R"({{"planar":{},"plane":[{},{}],"gravity":{},"note":{},"states":[{}]}})", planar, plane[0],
                     plane[1], g ? vector_of({(*g)[0], (*g)[1], (*g)[2]}) : "[0,0,0]", json_quoted(note),
                     fmt::join(parts, ",\n"));
}

}  // namespace mbsopt::inline app
