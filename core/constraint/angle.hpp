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

struct Angle {
  static constexpr int kRows = 1;
  static constexpr Displacements kDisplacements = Displacements::none;
  static constexpr RowQuantity quantity() { return RowQuantity::angle; }
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero(), s3 = Vector3d::Zero();  // n1, n2, a x n1 [-]

  // The value of angle nearest to reference among those a full turn apart.
  static double on_branch(double angle, double reference);

  void phi(const Frame& f1, const Frame& f2, Vec<1>& out) const;
  void phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const;
  void phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const;

  void jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const;

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const;

  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const;

 private:
  Dot1 cosine() const { return {s1, s2}; }
  Dot1 sine() const { return {s3, s2}; }
  struct Jet {
    double C, S, Cd, Sd, Cdd, Sdd, Ce, Se, D, N, E;  // N = C Sd - S Cd, E = C Cd + S Sd
  };
  Jet jet(const Frame& f1, const Frame& f2) const;
};
static_assert(IsPrimitive<Angle>);

}  // namespace mbsopt
