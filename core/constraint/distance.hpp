// Distance of two body points.   [m]
//   Phi      = l = |d|,   d = P2 - P1,  u = d/l
//   Phidot   = u'(d)dot,    Phiddot = u'(d)ddot + (|(d)dot|^2 - Phidot^2)/l
//   Phi_eta  = [ -u'  -(s1 x A1'u)'    u'  (s2 x A2'u)' ]
// Phi is l and not d'd, so its multiplier is the force in the rod [N] and a violation is a length. At l = 0 there is no
// direction, and u = 0.
#pragma once

#include "core/constraint/single_row.hpp"

namespace mbsopt {

struct Distance : SingleRow<Distance> {
  static constexpr Displacements kDisplacements = Displacements::any;
  static constexpr RowQuantity quantity() { return RowQuantity::length; }
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // the points from each centre of mass, body axes [m]

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const;
};
extern template struct SingleRow<Distance>;
static_assert(IsPrimitive<Distance>);

}  // namespace mbsopt
