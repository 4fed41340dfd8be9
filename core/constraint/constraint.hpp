// A constraint is a primitive in a mechanism: it names the bodies, the rows of Phi, and the derivatives of its
// geometry.
//
//   Phi(row) = sum of factor * primitive over the constraints of that row  -  the row's law f(t)     (time_law.hpp)
//
// Most rows have one constraint with factor 1 and no law. A gear's row has two: the angles of two joints.
#pragma once

#include <variant>

#include "core/constraint/angle.hpp"
#include "core/constraint/coincidence.hpp"
#include "core/constraint/coordinate.hpp"
#include "core/constraint/distance.hpp"
#include "core/constraint/dot1.hpp"
#include "core/constraint/dot2.hpp"

namespace mbsopt {

using Primitive = std::variant<Coincidence, Dot1, Dot2, Distance, Angle, Coordinate>;

struct Constraint : BodyPair {
  Primitive primitive;
  int joint = -1, drive = -1;  // index in the scene of the one that it belongs to
  int row = 0;                 // first row in Phi
  int block = 0;               // first row among the Jacobian blocks of all constraints
  double factor = 1;
  int slot_factor = -1;
  // The followed joint angle whose branch an Angle takes, or kNearestLaw.
  static constexpr int kNearestLaw = -1;
  int angle = kNearestLaw;

  int rows() const {
    return std::visit([](const auto& p) { return std::decay_t<decltype(p)>::kRows; }, primitive);
  }
  RowQuantity quantity() const {
    return std::visit([](const auto& p) { return p.quantity(); }, primitive);
  }
  // Calls f(body, s) for the points between which a length is measured; the ground has some, too.
  template <class F>
  void for_each_point(F&& f) const {
    std::visit(
        [&](const auto& p) {
          if constexpr (requires { p.s1; }) {
            if (p.quantity() == RowQuantity::length) {
              f(body1, p.s1);
              f(body2, p.s2);
            }
          }
        },
        primitive);
  }
};

}  // namespace mbsopt
