// Angle from a vector n1 of body 1 to a vector n2 of body 2, right-handed about the axis a of body 1.   [rad]
//   C = n1'n2,  S = (a x n1)'n2 (each a dot-1),  D = C^2 + S^2,   N_x = C S_x - S C_x
//   Phi     = atan2(S, C)          (on the branch within half a turn of zero; the caller that follows turns adds them)
//   Phidot  = N_dot/D              Phi_eta = (C S_eta - S C_eta)/D
//   Phiddot = (C Sddot - S Cddot)/D - 2 (C Cdot + S Sdot) N_dot/D^2
// D = 1 where the joint's axes are in line. The derivatives are exact off the constraints, too. So a torsional spring
// is the gradient of its potential everywhere.
#pragma once

#include "core/constraint/dot1.hpp"

namespace mbsopt {

struct Angle : SingleRow<Angle> {
  static constexpr Displacements kDisplacements = Displacements::none;
  static constexpr RowQuantity quantity() { return RowQuantity::angle; }
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero(), s3 = Vector3d::Zero();  // n1, n2, a x n1 [-]

  // The value of angle nearest to reference among those a full turn apart.
  static double on_branch(double angle, double reference);

  void phi(const Frame& f1, const Frame& f2, Vec<1>& out) const;  // without the atan2 of the other values

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const;
};
extern template struct SingleRow<Angle>;
static_assert(IsPrimitive<Angle>);

}  // namespace mbsopt
