#include "core/constraint/joints.hpp"

#include <array>

namespace mbsopt {
namespace {

using enum JointVector;

const std::array kSpherical{JointEquation{Coincidence{}, point1, point2}};
const std::array kRevolute{JointEquation{Coincidence{}, point1, point2}, JointEquation{Dot1{}, normal1, axis2},
                           JointEquation{Dot1{}, binormal1, axis2}};

const std::array kRecipes{JointRecipe{"spherical", kSpherical}, JointRecipe{"revolute", kRevolute}};

}  // namespace

const JointRecipe* joint_recipe(std::string_view type) {
  for (const JointRecipe& recipe : kRecipes) {
    if (recipe.type == type) return &recipe;
  }
  return nullptr;
}

}  // namespace mbsopt
