// Dot-1: a vector of body 1 stays perpendicular to a vector of body 2.   [-]
//   Phi      = x'y,   x = A1 s1,  y = A2 s2
//   Phidot   = xdot'y + x'ydot
//   Phiddot  = xddot'y + 2 xdot'ydot + x'yddot
//   Phi_eta  = [ 0  (s1 x A1'y)'   0  (s2 x A2'x)' ]
// Haug, "Computer Aided Kinematics and Dynamics of Mechanical Systems" (1989), section 9.4 (dot-1).
#pragma once

#include "core/constraint/primitive.hpp"

namespace mbsopt {

struct Dot1 {
  static constexpr int kRows = 1;
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // the two vectors, each in its body's axes [-]

  void phi(const Frame& f1, const Frame& f2, Vec<1>& out) const { out(0) = (f1.A * s1).dot(f2.A * s2); }
  void phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
    out(0) = (f1.Adot * s1).dot(f2.A * s2) + (f1.A * s1).dot(f2.Adot * s2);
  }
  void phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
    out(0) = (f1.Addot * s1).dot(f2.A * s2) + 2 * (f1.Adot * s1).dot(f2.Adot * s2) + (f1.A * s1).dot(f2.Addot * s2);
  }

  void jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
    const Vector3d x = f1.A * s1, y = f2.A * s2;
    J1.leftCols<3>().setZero(), J2.leftCols<3>().setZero();
    J1.rightCols<3>() = s1.cross(f1.A.transpose() * y).transpose();
    J2.rightCols<3>() = s2.cross(f2.A.transpose() * x).transpose();
  }

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 Vector3d& s1_bar, Vector3d& s2_bar) const {
    add_vector(f1, s1, f2, s2, z, bar1, s1_bar);
    add_vector(f2, s2, f1, s1, z, bar2, s2_bar);
  }

  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
    const Vector3d x = f1.A * s1, xd = f1.Adot * s1, xdd = f1.Addot * s1;
    const Vector3d y = f2.A * s2, yd = f2.Adot * s2, ydd = f2.Addot * s2;
    Lanes<3> dx = times(t1.A, s1), dxd = times(t1.Adot, s1), dxdd = times(t1.Addot, s1);
    Lanes<3> dy = times(t2.A, s2), dyd = times(t2.Adot, s2), dydd = times(t2.Addot, s2);
    if (s.s1) dx += f1.A * *s.s1, dxd += f1.Adot * *s.s1, dxdd += f1.Addot * *s.s1;
    if (s.s2) dy += f2.A * *s.s2, dyd += f2.Adot * *s.s2, dydd += f2.Addot * *s.s2;
    out.phi = dot(y, dx) + dot(x, dy);
    out.phi_dot = dot(y, dxd) + dot(xd, dy) + dot(yd, dx) + dot(x, dyd);
    out.phi_ddot = dot(y, dxdd) + dot(xdd, dy) + 2 * (dot(yd, dxd) + dot(xd, dyd)) + dot(ydd, dx) + dot(x, dydd);
    // (s1 x A1'y)' = s1' x A1'y + s1 x (A1''y + A1'y'), with '' the direction's part of A1'
    const Vector3d m1 = f1.A.transpose() * y, m2 = f2.A.transpose() * x;
    Lanes<3> moment1 = cross(s1, transposed_times(t1.A, y) + f1.A.transpose() * dy);
    Lanes<3> moment2 = cross(s2, transposed_times(t2.A, x) + f2.A.transpose() * dx);
    if (s.s1) moment1 -= cross(m1, *s.s1);
    if (s.s2) moment2 -= cross(m2, *s.s2);
    out.load1.setZero(), out.load2.setZero();
    out.load1.bottomRows<3>() = lambda(0) * moment1;
    out.load2.bottomRows<3>() = lambda(0) * moment2;
  }

 private:
  // Gradient with respect to the vector x = A s of one body, y the other's.
  static void add_vector(const Frame& f, const Vector3d& s, const Frame& other, const Vector3d& s_other,
                         const Multipliers<1>& z, FrameBar& bar, Vector3d& s_bar) {
    const Vector3d y = other.A * s_other, yd = other.Adot * s_other, ydd = other.Addot * s_other,
                   y_eta = other.A_eta * s_other;
    const double mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0), lambda = z.lambda(0);
    const Vector3d x_bar = lambda * y_eta + mu0 * y + mu1 * yd + mu2 * ydd;
    const Vector3d xd_bar = mu1 * y + 2 * mu2 * yd, xdd_bar = mu2 * y, x_eta_bar = lambda * y;
    bar.A += x_bar * s.transpose();
    bar.Adot += xd_bar * s.transpose();
    bar.Addot += xdd_bar * s.transpose();
    bar.A_eta += x_eta_bar * s.transpose();
    s_bar += f.A.transpose() * x_bar + f.Adot.transpose() * xd_bar + f.Addot.transpose() * xdd_bar +
             f.A_eta.transpose() * x_eta_bar;
  }
};
static_assert(IsPrimitive<Dot1>);

}  // namespace mbsopt
