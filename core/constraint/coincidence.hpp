// Coincidence: point P of body 1 and point P of body 2 are one point.   [m]
//   Phi      = r2 + A2 s2 - r1 - A1 s1
//   Phi_eta  = [ -I   A1 skew(s1)    I   -A2 skew(s2) ]
//   J' lambda: force -+lambda and moment -+ s x A'lambda on each body
#pragma once

#include "core/constraint/primitive.hpp"

namespace mbsopt {

struct Coincidence {
  static constexpr int kRows = 3;
  static constexpr Displacements kDisplacements = Displacements::own_axis;
  static constexpr RowQuantity quantity() { return RowQuantity::length; }
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // P seen from each centre of mass, in that body's axes [m]

  void phi(const Frame& f1, const Frame& f2, Vec<3>& out) const;
  void phi_dot(const Frame& f1, const Frame& f2, Vec<3>& out) const;
  void phi_ddot(const Frame& f1, const Frame& f2, Vec<3>& out) const;

  void jacobian(const Frame& f1, const Frame& f2, Mat<3, 6>& J1, Mat<3, 6>& J2) const;

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<3>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const;

  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& s, const Vec<3>& lambda, PrimitiveTangent<3>& out) const;

  void turning_blocks(const Frame& f1, const Frame& f2, const Vec<3>& lambda, TurningBlocks<3>& out) const;
};
static_assert(IsPrimitive<Coincidence> && HasTurningBlocks<Coincidence>);

}  // namespace mbsopt
