// Coincidence: point P of body 1 and point P of body 2 are one point.   [m]
//   Phi      = r2 + A2 s2 - r1 - A1 s1
//   Phi_eta  = [ -I   A1 skew(s1)    I   -A2 skew(s2) ]
//   J' lambda: force -+lambda and moment -+ s x A'lambda on each body
#pragma once

#include "core/constraint/primitive.hpp"

namespace mbsopt {

struct Coincidence {
  static constexpr int kRows = 3;
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // P seen from each centre of mass, in that body's axes [m]

  void phi(const Frame& f1, const Frame& f2, Vec<3>& out) const { out = f2.point(s2) - f1.point(s1); }
  void phi_dot(const Frame& f1, const Frame& f2, Vec<3>& out) const { out = f2.point_dot(s2) - f1.point_dot(s1); }
  void phi_ddot(const Frame& f1, const Frame& f2, Vec<3>& out) const { out = f2.point_ddot(s2) - f1.point_ddot(s1); }

  void jacobian(const Frame& f1, const Frame& f2, Mat<3, 6>& J1, Mat<3, 6>& J2) const {
    J1 << -Matrix3d::Identity(), f1.A * skew(s1);
    J2 << Matrix3d::Identity(), -f2.A * skew(s2);
  }

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<3>& z, FrameBar& bar1, FrameBar& bar2,
                 Vector3d& s1_bar, Vector3d& s2_bar) const {
    add_point(f2, s2, 1, z, bar2, s2_bar);
    add_point(f1, s1, -1, z, bar1, s1_bar);
  }

  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& s, const Vec<3>& lambda, PrimitiveTangent<3>& out) const {
    out.phi = t2.r + times(t2.A, s2) - t1.r - times(t1.A, s1);
    out.phi_dot = t2.rdot + times(t2.Adot, s2) - t1.rdot - times(t1.Adot, s1);
    out.phi_ddot = times(t2.Addot, s2) - times(t1.Addot, s1);
    out.load1.setZero(), out.load2.setZero();
    out.load1.bottomRows<3>() = -cross(s1, transposed_times(t1.A, lambda));
    out.load2.bottomRows<3>() = cross(s2, transposed_times(t2.A, lambda));
    if (s.s1) {
      out.phi -= f1.A * *s.s1;
      out.phi_dot -= f1.Adot * *s.s1;
      out.phi_ddot -= f1.Addot * *s.s1;
      out.load1.bottomRows<3>() += cross(f1.A.transpose() * lambda, *s.s1);
    }
    if (s.s2) {
      out.phi += f2.A * *s.s2;
      out.phi_dot += f2.Adot * *s.s2;
      out.phi_ddot += f2.Addot * *s.s2;
      out.load2.bottomRows<3>() -= cross(f2.A.transpose() * lambda, *s.s2);
    }
  }

 private:
  static void add_point(const Frame& f, const Vector3d& s, double sign, const Multipliers<3>& z, FrameBar& bar,
                        Vector3d& s_bar) {
    const Vector3d lambda = sign * z.lambda, mu0 = sign * z.mu0, mu1 = sign * z.mu1, mu2 = sign * z.mu2;
    bar.r += mu0;
    bar.rdot += mu1;
    bar.A += mu0 * s.transpose();
    bar.Adot += mu1 * s.transpose();
    bar.Addot += mu2 * s.transpose();
    bar.A_eta += lambda * s.transpose();
    s_bar +=
        f.A.transpose() * mu0 + f.Adot.transpose() * mu1 + f.Addot.transpose() * mu2 + f.A_eta.transpose() * lambda;
  }
};
static_assert(IsPrimitive<Coincidence>);

}  // namespace mbsopt
