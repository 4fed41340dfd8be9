// A primitive placed in a mechanism: which bodies it ties, which rows of Phi it owns, where its geometry's derivatives
// are.
#pragma once

#include <variant>

#include "core/constraint/coincidence.hpp"
#include "core/constraint/dot1.hpp"

namespace mbsopt {

using Primitive = std::variant<Coincidence, Dot1>;

struct Constraint {
  Primitive primitive;
  int joint = 0;               // index in the scene
  int body1 = 0, body2 = 0;    // 0 is the ground
  int row = 0;                 // first row in Phi
  int slot1 = -1, slot2 = -1;  // first row of s1, s2 among the differentiated fields; -1: constant
  double alpha = 1;            // alpha of the augmented Lagrangian per unit of its relative alpha: the inertia seen

  int rows() const {
    return std::visit([](const auto& p) { return std::decay_t<decltype(p)>::kRows; }, primitive);
  }
};

}  // namespace mbsopt
