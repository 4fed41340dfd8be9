#include "app/report/motion_scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/report/html_text.hpp"
#include "app/report/mechanism_sketch.hpp"
#include "core/scene/scene_facts.hpp"

namespace mbsopt {
namespace {

constexpr std::size_t kMostNumbers = 20'000;  // of all poses: some 200 kB of the page
constexpr std::size_t kFewestRows = 60;       // fewer rows do not show a smooth motion
constexpr std::size_t kPose = 7;              // x y z e0 e1 e2 e3

std::string vector_of(const Eigen::Vector3d& v) { return fmt::format("[{:.6g},{:.6g},{:.6g}]", v.x(), v.y(), v.z()); }

long number_of(const SketchPoint& p) { return p.body == kGround ? -1 : static_cast<long>(p.body); }

std::string ends_of(const SketchPoint& p1, const SketchPoint& p2) {
  return fmt::format(R"("b1":{},"p1":{},"b2":{},"p2":{})", number_of(p1), vector_of(p1.s), number_of(p2),
                     vector_of(p2.s));
}

// Keeps one of several rows, and the last.
std::vector<std::size_t> kept_rows(std::size_t rows, std::size_t most) {
  std::vector<std::size_t> kept;
  const std::size_t stride = (rows + most - 1) / most;
  for (std::size_t k = 0; k < rows; k += stride) kept.push_back(k);
  if (kept.back() + 1 != rows) kept.push_back(rows - 1);
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
  std::vector<std::string> all;
  for (const PointTarget& target : targets) {
    std::vector<std::string> place;
    for (const std::vector<double>& x : target.place)
      place.push_back(x.empty() ? "null" : std::to_string(arrays.add(x)));
    all.push_back(fmt::format(R"({{"measured":{},"b":{},"p":{},"t":{},"place":[{}]}})", target.measured,
                              number_of(target.point), vector_of(target.point.s), arrays.add(target.t, 9),
                              fmt::join(place, ",")));
  }
  return fmt::format("[{}]", fmt::join(all, ","));
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
  const auto column = [&](std::size_t index) {
    std::vector<double> values;
    for (const std::vector<double>& row : forces.rows) values.push_back(row[index]);
    return values;
  };
  std::vector<std::string> joints;
  for (std::size_t k = 1; k + 2 < forces.columns.size(); k += 3) {
    const std::string name = forces.columns[k].substr(0, forces.columns[k].size() - 2);  // "A.x"
    const auto joint = std::ranges::find(state.scene.joints, name, &Joint::name);
    if (joint == state.scene.joints.end()) continue;
    const SketchPoint on = point_of(state.scene, joint->body2, joint->point2);
    joints.push_back(fmt::format(R"({{"b":{},"p":{},"force":[{},{},{}]}})", number_of(on), vector_of(on.s),
                                 arrays.add(column(k)), arrays.add(column(k + 1)), arrays.add(column(k + 2))));
  }
  return fmt::format(R"({{"t":{},"large":{:.6g},"joints":[{}]}})", arrays.add(column(0), 9), large,
                     fmt::join(joints, ","));
}

std::string state_json(PageArrays& arrays, const MovingState& state, std::size_t most) {
  const Sketch sketch = sketch_of(state.scene);
  const auto& rows = state.trajectory.rows;
  const std::vector<std::size_t> kept = kept_rows(rows.size(), most);
  const auto column = [&](std::size_t index) {
    std::vector<double> values;
    for (const std::size_t k : kept) values.push_back(rows[k][index]);
    return values;
  };
  std::vector<std::string> bodies, joints, springs, traces;
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    std::vector<std::string> points, shapes, row;
    for (const Eigen::Vector3d& s : sketch.bodies[i]) points.push_back(vector_of(s));
    for (const SketchedShape& shape : sketch.shapes)
      if (shape.body == i)
        shapes.push_back(fmt::format(R"({{"type":{},"from":{},"to":{},"radius":{:.6g}}})", json_quoted(shape.type),
                                     vector_of(shape.from), vector_of(shape.to), shape.radius));
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    for (std::size_t k = 0; k < kPose; ++k) row.push_back(coordinate(arrays, column(1 + 13 * i + k)));
    bodies.push_back(fmt::format(R"({{"name":{},"points":[{}],"shapes":[{}],"row":[{}]}})",
                                 json_quoted(state.scene.bodies[i].name), fmt::join(points, ","),
                                 fmt::join(shapes, ","), fmt::join(row, ",")));
  }
  for (const SketchedJoint& joint : sketch.joints)
    joints.push_back(fmt::format(R"({{"type":{},{},"axis":{}}})", json_quoted(joint.type),
                                 ends_of(joint.on_body1, joint.on_body2),
                                 joint.axis ? vector_of(*joint.axis) : "null"));
  for (const SketchedSpring& spring : sketch.springs)
    springs.push_back(fmt::format(R"({{{},"spring":{},"damper":{}}})", ends_of(spring.from, spring.to), spring.spring,
                                  spring.damper));
  for (const TracedPoint& trace : sketch.traces)
    traces.push_back(fmt::format(R"({{"name":{},"b":{},"p":{}}})", json_quoted(trace.name), number_of(trace.point),
                                 vector_of(trace.point.s)));
  return fmt::format(
      R"({{"name":{},"ghost":{},"t":{},"bodies":[{}],"joints":[{}],"springs":[{}],"traces":[{}],"targets":{},)"
      R"("reactions":{}}})",
      json_quoted(state.name), state.ghost, arrays.add(column(0), 9), fmt::join(bodies, ","), fmt::join(joints, ","),
      fmt::join(springs, ","), fmt::join(traces, ","), targets_json(arrays, state.targets),
      reactions_json(arrays, state));
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

}  // namespace mbsopt
