// Where points of a mechanism should be, or were measured to be, for script/viewer.js.
//
//   const std::vector<PointTarget> targets = prescribed_points(problem);
//   page.motion(motion_scene(page.arrays(), plane, {{.name = "a", .scene = scene, .targets = targets, ...}}), stills);
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/report/mechanism_sketch.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// One point over time. The global coordinates [m] that nobody prescribed or measured are empty.
struct PointTarget {
  BodyPoint point;
  bool measured = false;
  std::vector<double> t = {};  // [s], ascending
  std::array<std::vector<double>, 3> place = {};
};

// Values of a sensor at times.
struct SensorValues {
  std::string sensor;
  std::vector<double> t, value;  // [s], [unit of the sensor]
};

// From sensors of positions in global axes; others are left out. Sensors of one point at the same times give one
// target. A target keeps at most 200 times.
std::vector<PointTarget> point_targets(const Scene& scene, const std::vector<SensorValues>& values, bool measured);

// From all terms `track` of the problem, within the time that is simulated. instants: per objective, of its points
// without prescribed timing (SimulatedMotion); where there are none, such points are left out.
std::vector<PointTarget> prescribed_points(const Problem& problem,
                                           const std::vector<std::vector<double>>& instants = {});

}  // namespace mbsopt
