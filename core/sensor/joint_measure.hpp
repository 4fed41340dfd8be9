// The coordinate x of a joint: the angle about its axis or the displacement along it. Sensors, drives and forces in
// joints use it. Its equations are those of the primitive.
#pragma once

#include <type_traits>

#include "core/constraint/angle.hpp"

namespace mbsopt {

struct Dot2;  // core/constraint/dot2.hpp

template <class P>  // Angle, Dot2 or Coordinate
struct JointMeasure : BodyPair {
  P measure;

  // An angle lies within half a turn of zero.
  double value(const Frame& f1, const Frame& f2) const {
    Vec<1> x;
    measure.phi(f1, f2, x);
    return x(0);
  }
  double rate(const Frame& f1, const Frame& f2) const {
    Vec<1> xdot;
    measure.phi_dot(f1, f2, xdot);
    return xdot(0);
  }
  // Returns an angle on the turn nearest to the reference. A displacement has no turns.
  double value_near(double reference, const Frame& f1, const Frame& f2) const {
    if constexpr (std::is_same_v<P, Angle>) return Angle::on_branch(value(f1, f2), reference);
    return value(f1, f2);
  }
};

using JointAngle = JointMeasure<Angle>;        // [rad]
using JointDisplacement = JointMeasure<Dot2>;  // [m]

}  // namespace mbsopt
