// The table of joints: each is a list of primitives between vectors that its fields give. A new joint is a new row.
// A tie of angles or displacements of joints to each other (gear, rack_pinion, the thread of a screw) or to a law
// (drives) adds primitives to one row and is put together where scenes are compiled.
#pragma once

#include <span>
#include <string_view>

#include "core/constraint/constraint.hpp"

namespace mbsopt {

// across1, binormal1: unit vectors of body 1 that complete axis1 to a right-handed triad (axis1, across1, binormal1).
// keep1, keep2: normal1, and axis2 x normal2: at right angles while the normals are parallel.
// x1 y1 y2 z2: the global axes as the bodies see them at the orientations in the file.
enum class JointVector {
  none,
  point1,
  point2,
  axis1,
  axis2,
  across1,
  binormal1,
  keep1,
  keep2,
  x1,
  y1,
  y2,
  z2,
};

struct JointEquation {
  Primitive primitive;  // its vectors are filled in by the compiler
  JointVector s1, s2, s3 = JointVector::none;
};

struct JointRecipe {
  std::string_view type;
  std::span<const JointEquation> equations;
  bool has_angle = false, has_displacement = false;
};

// Null when there is no such joint.
const JointRecipe* joint_recipe(std::string_view type);

}  // namespace mbsopt
