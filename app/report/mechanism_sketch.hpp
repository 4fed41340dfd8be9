// The parts of a mechanism that drawings show: points of its bodies, joints, springs and dampers, points of sensors.
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

struct SketchedJoint {
  std::string type;
  SketchPoint on_body1, on_body2;
  std::optional<Eigen::Vector3d> axis;  // in body 1
};

struct SketchedSpring {
  SketchPoint from, to;
  bool spring, damper;  // whether each of them acts
};

// The point of a position sensor, whose path is drawn.
struct TracedPoint {
  std::string name;
  SketchPoint point;
};

struct SketchedShape {
  std::size_t body;
  std::string type;
  Eigen::Vector3d from, to;
  double radius;
};

struct Sketch {
  std::vector<std::vector<Eigen::Vector3d>> bodies;  // points of each
  std::vector<SketchedJoint> joints;
  std::vector<SketchedSpring> springs;
  std::vector<TracedPoint> traces;
  std::vector<SketchedShape> shapes;
};

// Takes the values of the scene's parameters.
Sketch sketch_of(const Scene& scene);

// A point of a body of the scene, or of the ground.
SketchPoint point_of(const Scene& scene, const std::string& body, const PointField& point);

// Global position of a point, from a trajectory's row: t, then 13 numbers per body.
Eigen::Vector3d placed(const std::vector<double>& row, const SketchPoint& p);

}  // namespace mbsopt::inline app
