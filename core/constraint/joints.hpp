// The table of joints: each is a list of primitives between vectors that its fields give. A new joint is a new row.
#pragma once

#include <span>
#include <string_view>

#include "core/constraint/constraint.hpp"

namespace mbsopt {

// normal1, binormal1: unit vectors of body 1 that complete axis1 to a right-handed triad (axis1, normal1, binormal1).
enum class JointVector { point1, point2, axis2, normal1, binormal1 };

struct JointEquation {
  Primitive primitive;  // its vectors are filled in by the compiler
  JointVector s1, s2;
};

struct JointRecipe {
  std::string_view type;
  std::span<const JointEquation> equations;
};

// Null when there is no such joint.
const JointRecipe* joint_recipe(std::string_view type);

}  // namespace mbsopt
