// Prescribed or measured positions of points of a mechanism, for script/viewer.js.
//
//   const std::vector<PointTarget> targets = prescribed_points(problem);
//   page.motion(motion_scene(plane, {{.name = "a", .scene = scene, .targets = targets, ...}}), stills);
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/report/mechanism_sketch.hpp"
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

}  // namespace mbsopt::inline app
