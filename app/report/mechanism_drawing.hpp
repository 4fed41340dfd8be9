// A sketch of a mechanism (mechanism_sketch.hpp), projected on the coordinate plane in which the mechanism moves most.
// Several states lie on top of each other, all but the last one dashed.
//
//   const MotionPlane plane = plane_of_motion(scene, trajectory);
//   page.drawing(mechanism_drawing("start and end", plane.axes, {{"start", scene, first_row}, {"end", scene,
//   last_row}}));
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/results/trajectory_csv.hpp"

namespace mbsopt::inline app {

struct DrawnState {
  std::string name;
  const Scene& scene;              // its points, at the values that its parameters have
  const std::vector<double>& row;  // of a trajectory
};

// The two axes (0, 1, 2) along which the bodies' points move most. If they move along fewer, their spread decides.
struct MotionPlane {
  std::array<int, 2> axes;
  bool holds_all;  // no point moves along the third axis
};
MotionPlane plane_of_motion(const Scene& scene, const Trajectory& trajectory);

// SVG text; empty if there is no state, or if a distance in it overflows.
std::string mechanism_drawing(const std::string& title, std::array<int, 2> plane,
                              const std::vector<DrawnState>& states);

// A scene with other values of its parameters.
Scene with_values(Scene scene, const Eigen::VectorXd& rho);

}  // namespace mbsopt::inline app
