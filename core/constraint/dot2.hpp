// Dot-2: the component along a vector of body 1 of the separation of two points.   [m]
//   Phi      = w'd,   w = A1 s3,  d = P2 - P1 = r2 + A2 s2 - r1 - A1 s1
//   Phidot   = (w)dot'd + w'(d)dot,   Phiddot = (w)ddot'd + 2 (w)dot'(d)dot + w'(d)ddot
//   Phi_eta  = [ -w'  (s3 x A1'd - s1 x A1'w)'    w'  (s2 x A2'w)' ]
// With s3 across a joint's axis, Phi = 0 lets the point slide along the axis. With s3 along the axis, Phi is the
// joint's displacement. Haug (1989), section 9.4 (dot-2).
#pragma once

#include "core/constraint/single_row.hpp"

namespace mbsopt {

struct Dot2 : SingleRow<Dot2> {
  static constexpr Displacements kDisplacements = Displacements::any;
  static constexpr RowQuantity quantity() { return RowQuantity::length; }
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // the points from each centre of mass, body axes [m]
  Vector3d s3 = Vector3d::Zero();                         // the direction, axes of body 1 [-]

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const;
};
extern template struct SingleRow<Dot2>;
static_assert(IsPrimitive<Dot2>);

}  // namespace mbsopt
