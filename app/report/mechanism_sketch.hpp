// Drawings of a mechanism show hulls of its bodies, marks (joints, springs, dampers, the ground) at points,
// and points whose paths are drawn. mechanism_drawing.hpp draws it at some instants, script/viewer.js moves it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt::inline app {

inline constexpr std::size_t kGround = static_cast<std::size_t>(-1);

// A point of a body, in that body's frame.
struct SketchPoint {
  std::size_t body;  // its number, or kGround
  Eigen::Vector3d s;
  bool operator==(const SketchPoint&) const = default;
};

struct SketchedBody {
  std::vector<Eigen::Vector3d> points;              // of joints, forces, sensors, shapes, and its own
  std::vector<std::vector<Eigen::Vector3d>> hulls;  // convex: of each shape but spheres, else of its points
  bool solid = false;                               // has shapes
};

// A path of SVG about a point [px].
struct SketchedMark {
  std::string style, path;  // style: its class
  SketchPoint at;
  std::optional<SketchPoint> to = {};    // x from 0 to 1 is stretched to this point
  std::optional<SketchPoint> axis = {};  // else x is turned to this unit vector of a body
  bool foreshortened = false;            // x is also shortened as a projection of the axis
  double radius = 0;                     // else x and y are in units of this length [m]
};

// The point of a position sensor, whose path is drawn.
struct TracedPoint {
  std::string name;
  SketchPoint point;
};

struct Sketch {
  std::vector<SketchedBody> bodies;
  std::vector<SketchedMark> marks;
  std::vector<TracedPoint> traces;
};

// Takes the values of the scene's parameters.
Sketch sketch_of(const Scene& scene);

// A point of a body of the scene, or of the ground.
SketchPoint point_of(const Scene& scene, const std::string& body, const PointField& point);

// Global position of a point, from a trajectory's row: t, then 13 numbers per body; a direction is only turned.
Eigen::Vector3d placed(const std::vector<double>& row, const SketchPoint& p);
Eigen::Vector3d turned(const std::vector<double>& row, const SketchPoint& direction);

}  // namespace mbsopt::inline app
