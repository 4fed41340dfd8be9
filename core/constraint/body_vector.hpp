// Primitives are written in body-fixed vectors and in the separation of two body points, along the motion. Only the
// primitives' own .cpp files include this header, because its functions are inline.
#pragma once

#include <utility>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/constraint/primitive.hpp"

namespace mbsopt {

// A body-fixed vector x = A s along the motion, under a virtual displacement and in tangent directions.
struct VectorJet {
  Vector3d x, xd, xdd, x_eta;
  VectorJet(const Frame& f, const Vector3d& s) : x(f.A * s), xd(f.Adot * s), xdd(f.Addot * s), x_eta(f.A_eta * s) {}
  VectorJet(Vector3d v, Vector3d d, Vector3d dd, Vector3d eta)
      : x(std::move(v)), xd(std::move(d)), xdd(std::move(dd)), x_eta(std::move(eta)) {}
};
struct VectorTangent {
  Lanes<3> x, xd, xdd;
  VectorTangent(const Frame& f, const FrameTangent& t, const Vector3d& s, const Lanes<3>* ds) {
    if (t.still) {
      x.setZero(), xd.setZero(), xdd.setZero();
    } else {
      x = times(t.A, s), xd = times(t.Adot, s), xdd = times(t.Addot, s);
    }
    if (ds) x += f.A * *ds, xd += f.Adot * *ds, xdd += f.Addot * *ds;
  }
};

// Derivatives of x, xd, xdd in p and pdot with omegadot held fixed; xd_pdot = x_p. All are values of N, since
//   Addot = A(p) (skew(omegadot) - 2 (pdot'pdot)) + 2 A(pdot)
struct VectorBlocks {
  Mat<3, 4> x_p, xd_p, xdd_p, xdd_pdot;
  VectorBlocks(const BodyState& b, const Frame& f, const Vector3d& s)
      : x_p(N(b.p, s)),
        xd_p(N(b.pdot, s)),
        xdd_p(N(b.p, b.omegadot.cross(s) - 2 * b.pdot.squaredNorm() * s)),
        xdd_pdot(2 * xd_p - 4 * (f.A * s) * b.pdot.transpose()) {}
};

// d = P2 - P1 of two body points, and its tangent. The tangent of xdd has no part of rddot', which tangents hold fixed.
inline VectorJet separation(const Frame& f1, const Frame& f2, const Vector3d& s1, const Vector3d& s2) {
  return {f2.point(s2) - f1.point(s1), f2.point_dot(s2) - f1.point_dot(s1), f2.point_ddot(s2) - f1.point_ddot(s1),
          f2.point_eta(s2) - f1.point_eta(s1)};
}
inline VectorTangent separation_tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1,
                                        const FrameTangent& t2, const Vector3d& s1, const Vector3d& s2,
                                        const GeometryTangent& s) {
  VectorTangent d(f2, t2, s2, s.s2);
  const VectorTangent d1(f1, t1, s1, s.s1);
  d.x += t2.r - t1.r - d1.x;
  d.xd += t2.rdot - t1.rdot - d1.xd;
  d.xdd -= d1.xdd;
  return d;
}

// Adds the cotangents of x, xd, xdd, x_eta of a body-fixed vector to its frame and to s. With sign they are those of a
// body point.
inline void add_vector_bar(const Frame& f, const Vector3d& s, const VectorJet& bar, double sign, FrameBar& frame_bar,
                           Vector3d& s_bar) {
  const Vector3d st = sign * s;
  frame_bar.A += bar.x * st.transpose();
  frame_bar.Adot += bar.xd * st.transpose();
  frame_bar.Addot += bar.xdd * st.transpose();
  frame_bar.A_eta += bar.x_eta * st.transpose();
  s_bar += sign * (f.A.transpose() * bar.x + f.Adot.transpose() * bar.xd + f.Addot.transpose() * bar.xdd +
                   f.A_eta.transpose() * bar.x_eta);
}
inline void add_point_bar(const Frame& f, const Vector3d& s, const VectorJet& bar, double sign, FrameBar& frame_bar,
                          Vector3d& s_bar) {
  frame_bar.r += sign * bar.x;
  frame_bar.rdot += sign * bar.xd;
  add_vector_bar(f, s, bar, sign, frame_bar, s_bar);
}

// Tangent of the moment s x A'F (body axes) of a force F at s.
inline Lanes<3> moment_tangent(const Frame& f, const FrameTangent& t, const Vector3d& s, const Lanes<3>* ds,
                               const Vector3d& F, const Lanes<3>& dF) {
  Lanes<3> m = t.still ? cross(s, f.A.transpose() * dF) : cross(s, transposed_times(t.A, F) + f.A.transpose() * dF);
  if (ds) m -= cross(f.A.transpose() * F, *ds);
  return m;
}

// Cotangent of x in  lambda (x'y)_eta + mu0 x'y + mu1 (x'y)dot + mu2 (x'y)ddot.
inline VectorJet product_bar(const VectorJet& y, const Multipliers<1>& z) {
  const double lambda = z.lambda(0), mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0);
  return {lambda * y.x_eta + mu0 * y.x + mu1 * y.xd + mu2 * y.xdd, mu1 * y.x + 2 * mu2 * y.xd, mu2 * y.x, lambda * y.x};
}
// Tangent of x'y and of its first two time derivatives.
inline void product_tangent(const VectorJet& x, const VectorJet& y, const VectorTangent& dx, const VectorTangent& dy,
                            PrimitiveTangent<1>& out) {
  out.phi = dot(y.x, dx.x) + dot(x.x, dy.x);
  out.phi_dot = dot(y.x, dx.xd) + dot(x.xd, dy.x) + dot(y.xd, dx.x) + dot(x.x, dy.xd);
  out.phi_ddot = dot(y.x, dx.xdd) + dot(x.xdd, dy.x) + 2 * (dot(y.xd, dx.xd) + dot(x.xd, dy.xd)) + dot(y.xdd, dx.x) +
                 dot(x.x, dy.xdd);
}

}  // namespace mbsopt
