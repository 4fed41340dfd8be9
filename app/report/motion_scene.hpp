// A mechanism over time, as JSON for script/viewer.js: poses of its bodies, points, joints, springs, paths,
// prescribed and measured places, forces of joints.
//
//   page.motion(motion_scene(plane, {{"before", scene, before, true}, {"after", designed, after}}), stills);
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/files/json_text.hpp"
#include "app/report/mechanism_drawing.hpp"
#include "app/report/mechanism_sketch.hpp"
#include "app/results/trajectory_csv.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

// One point over time. Global coordinates [m] that are neither prescribed nor measured are empty.
struct PointTarget {
  SketchPoint point;
  bool measured = false;
  std::vector<double> t = {};  // [s], ascending
  std::array<std::vector<double>, 3> place = {};
};

// Values of a sensor at times.
struct SensorValues {
  std::string sensor;
  std::vector<double> t, value;  // [s], [unit of the sensor]
};

// Takes sensors of positions in global axes, and omits others. Sensors of one point at the same times give one target.
// A target keeps at most 200 times.
std::vector<PointTarget> point_targets(const Scene& scene, const std::vector<SensorValues>& values, bool measured);

// Takes all terms `track` of the problem, within the simulated time. instants holds, per objective, those of its points
// without prescribed timing (SimulatedMotion). Without instants such points are left out.
std::vector<PointTarget> prescribed_points(const Problem& problem,
                                           const std::vector<std::vector<double>>& instants = {});

struct MovingState {
  std::string name;
  const Scene& scene;  // its points, at the values that its parameters have
  const Trajectory& trajectory;
  bool ghost = false;  // drawn faintly behind the others
  std::vector<PointTarget> targets = {};
  Trajectory forces = {};  // of joints (recorded_motion.hpp)
};

// The view first shows the plane if it holds all motion. Returns null if a state has less than two
// rows or a number in it is not finite.
Json motion_scene(const MotionPlane& plane, const std::vector<MovingState>& states);

}  // namespace mbsopt::inline app
