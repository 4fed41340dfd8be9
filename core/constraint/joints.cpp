#include "core/constraint/joints.hpp"

#include <array>

namespace mbsopt {
namespace {

using enum JointVector;

const JointEquation kPoint{Coincidence{}, point1, point2};
const JointEquation kParallel1{Dot1{}, across1, axis2}, kParallel2{Dot1{}, binormal1, axis2};  // axes in line
const JointEquation kOnAxis1{Dot2{}, point1, point2, across1}, kOnAxis2{Dot2{}, point1, point2, binormal1};
const JointEquation kInPlane{Dot2{}, point1, point2, axis1};
const JointEquation kPerpendicularAxes{Dot1{}, axis1, axis2};

const std::array kSpherical{kPoint};
const std::array kRevolute{kPoint, kParallel1, kParallel2};
const std::array kUniversal{kPoint, kPerpendicularAxes};
const std::array kFixed{kPoint, JointEquation{Dot1{}, x1, y2}, JointEquation{Dot1{}, x1, z2},
                        JointEquation{Dot1{}, y1, z2}};
const std::array kCylindrical{kParallel1, kParallel2, kOnAxis1, kOnAxis2};
const std::array kTranslational{kParallel1, kParallel2, kOnAxis1, kOnAxis2, JointEquation{Dot1{}, keep1, keep2}};
const std::array kPlanar{kParallel1, kParallel2, kInPlane};
const std::array kPointOnLine{kOnAxis1, kOnAxis2};
const std::array kPointOnPlane{kInPlane};
const std::array kPerpendicular{kPerpendicularAxes};
const std::array kDistance{JointEquation{Distance{}, point1, point2}};

const std::array kRecipes{
    JointRecipe{"spherical", kSpherical},
    JointRecipe{"revolute", kRevolute, true},
    JointRecipe{"universal", kUniversal},
    JointRecipe{"fixed", kFixed},
    JointRecipe{"cylindrical", kCylindrical, true, true},
    JointRecipe{"screw", kCylindrical, true, true},
    JointRecipe{"translational", kTranslational, false, true},
    JointRecipe{"planar", kPlanar},
    JointRecipe{"point_on_line", kPointOnLine},
    JointRecipe{"point_on_plane", kPointOnPlane},
    JointRecipe{"perpendicular", kPerpendicular},
    JointRecipe{"distance", kDistance},
    JointRecipe{"gear", {}},
    JointRecipe{"rack_pinion", {}},
};

}  // namespace

const JointRecipe* joint_recipe(std::string_view type) {
  for (const JointRecipe& recipe : kRecipes) {
    if (recipe.type == type) return &recipe;
  }
  return nullptr;
}

}  // namespace mbsopt
