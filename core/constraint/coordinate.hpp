// One of the seven coordinates of body 2: x, y, z of the centre of mass [m] or an Euler parameter e0..e3 [-].
//   Phi = r_k  or  p_k        Phi_eta = [ e_k'  0 ]  or  [ 0  (1/2 G(p)' )_k ]
// Its time derivatives are those of the frame. pddot includes the part of the unit-norm equation (frame.hpp).
#pragma once

#include "core/constraint/primitive.hpp"

namespace mbsopt {

struct Coordinate {
  static constexpr int kRows = 1;
  static constexpr Displacements kDisplacements = Displacements::any;
  int index = 0;  // 0..2: x y z, 3..6: e0..e3
  RowQuantity quantity() const { return index < 3 ? RowQuantity::length : RowQuantity::euler_parameter; }

  void phi(const Frame&, const Frame& f, Vec<1>& out) const;
  void phi_dot(const Frame&, const Frame& f, Vec<1>& out) const;
  void phi_ddot(const Frame&, const Frame& f, Vec<1>& out) const;

  void jacobian(const Frame&, const Frame& f, Mat<1, 6>& J1, Mat<1, 6>& J2) const;

  void pull_back(const Frame&, const Frame&, const Multipliers<1>& z, FrameBar&, FrameBar& bar, GeometryBar&) const;

  void tangent(const Frame&, const Frame&, const FrameTangent&, const FrameTangent& t, const GeometryTangent&,
               const Vec<1>& lambda, PrimitiveTangent<1>& out) const;

 private:
  double of(const Vector3d& r, const Vector4d& p) const { return index < 3 ? r(index) : p(index - 3); }
};
static_assert(IsPrimitive<Coordinate>);

}  // namespace mbsopt
