// Dot-1: a vector of body 1 stays perpendicular to a vector of body 2.   [-]
//   Phi      = x'y,   x = A1 s1,  y = A2 s2
//   Phidot   = xdot'y + x'ydot
//   Phiddot  = xddot'y + 2 xdot'ydot + x'yddot
//   Phi_eta  = [ 0  (s1 x A1'y)'   0  (s2 x A2'x)' ]
// Haug, "Computer Aided Kinematics and Dynamics of Mechanical Systems" (1989), section 9.4 (dot-1).
#pragma once

#include "core/constraint/single_row.hpp"

namespace mbsopt {

struct Dot1 : SingleRow<Dot1> {
  static constexpr Displacements kDisplacements = Displacements::none;
  static constexpr RowQuantity quantity() { return RowQuantity::cosine; }
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // the two vectors, each in its body's axes [-]

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const;

  void turning_blocks(const Frame& f1, const Frame& f2, const Vec<1>& lambda, TurningBlocks<1>& out) const;
};
extern template struct SingleRow<Dot1>;
static_assert(IsPrimitive<Dot1> && HasTurningBlocks<Dot1>);

}  // namespace mbsopt
