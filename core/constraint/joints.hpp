// The table of joints: each is a list of primitives between vectors that its fields give. A new joint is a new row.
// Gears, racks, screws and drives tie angles or displacements of joints to each other or to a law. They add primitives
// to one row; the compiler of scenes (compile_joints.cpp, compile_drives.cpp) builds them.
#pragma once

#include <span>
#include <string_view>

#include "core/constraint/constraint.hpp"

namespace mbsopt {

// across1 and binormal1 are unit vectors of body 1 that complete axis1 to a right-handed triad (axis1, across1,
// binormal1). The vector keep1 is normal1, keep2 is axis2 x normal2: they are at right angles while the normals are
// parallel. Vectors x1 y1 y2 z2 are the global axes as the bodies see them at the orientations in the file.
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
