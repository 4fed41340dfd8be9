// A mechanism over time, as JSON for script/viewer.js: poses of its bodies, points, joints, springs, paths,
// prescribed and measured places, forces of joints.
//
//   page.motion(motion_scene(plane, {{"before", scene, before, true}, {"after", designed, after}}), stills);
#pragma once

#include <string>
#include <vector>

#include "app/files/json_text.hpp"
#include "app/report/mechanism_drawing.hpp"
#include "app/report/point_targets.hpp"
#include "app/results/trajectory_csv.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt::inline app {

struct MovingState {
  std::string name;
  const Scene& scene;  // its points, at the values that its parameters have
  const Trajectory& trajectory;
  bool ghost = false;  // drawn faintly behind the others
  std::vector<PointTarget> targets = {};
  Trajectory forces = {};  // of joints (joint_forces.hpp)
};

// The view first shows the plane if it holds all motion. Returns null if a state has less than two
// rows or a number in it is not finite.
Json motion_scene(const MotionPlane& plane, const std::vector<MovingState>& states);

}  // namespace mbsopt::inline app
