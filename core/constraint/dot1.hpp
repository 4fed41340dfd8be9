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
  double change(const Frame& f1, const Frame& f2) const {  // under the frames' virtual displacement
    return (f1.A_eta * s1).dot(f2.A * s2) + (f1.A * s1).dot(f2.A_eta * s2);
  }

  void jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
    const Vector3d x = f1.A * s1, y = f2.A * s2;
    J1.leftCols<3>().setZero(), J2.leftCols<3>().setZero();
    J1.rightCols<3>() = s1.cross(f1.A.transpose() * y).transpose();
    J2.rightCols<3>() = s2.cross(f2.A.transpose() * x).transpose();
  }

  void pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                 GeometryBar& s) const {
    const VectorJet x(f1, s1), y(f2, s2);
    add_vector_bar(f1, s1, product_bar(y, z), 1, bar1, s.s1);
    add_vector_bar(f2, s2, product_bar(x, z), 1, bar2, s.s2);
  }
  // Cotangent of x in  lambda (x'y)_eta + mu0 x'y + mu1 (x'y)dot + mu2 (x'y)ddot.
  static VectorJet product_bar(const VectorJet& y, const Multipliers<1>& z) {
    const double lambda = z.lambda(0), mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0);
    return {lambda * y.x_eta + mu0 * y.x + mu1 * y.xd + mu2 * y.xdd, mu1 * y.x + 2 * mu2 * y.xd, mu2 * y.x,
            lambda * y.x};
  }

  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
    const VectorJet x(f1, s1), y(f2, s2);
    const VectorTangent dx(f1, t1, s1, s.s1), dy(f2, t2, s2, s.s2);
    product_tangent(x, y, dx, dy, out);
    out.load1.setZero(), out.load2.setZero();
    out.load1.bottomRows<3>() = lambda(0) * moment_tangent(f1, t1, s1, s.s1, y.x, dy.x);
    out.load2.bottomRows<3>() = lambda(0) * moment_tangent(f2, t2, s2, s.s2, x.x, dx.x);
  }
  static void product_tangent(const VectorJet& x, const VectorJet& y, const VectorTangent& dx, const VectorTangent& dy,
                              PrimitiveTangent<1>& out) {
    out.phi = dot(y.x, dx.x) + dot(x.x, dy.x);
    out.phi_dot = dot(y.x, dx.xd) + dot(x.xd, dy.x) + dot(y.xd, dx.x) + dot(x.x, dy.xd);
    out.phi_ddot = dot(y.x, dx.xdd) + dot(x.xdd, dy.x) + 2 * (dot(y.xd, dx.xd) + dot(x.xd, dy.xd)) + dot(y.xdd, dx.x) +
                   dot(x.x, dy.xdd);
  }
};
static_assert(IsPrimitive<Dot1>);

}  // namespace mbsopt
