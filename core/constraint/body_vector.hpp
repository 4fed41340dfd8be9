// Primitives are written in body-fixed vectors and in the separation of two body points, along the motion. Only the
// primitives' own .cpp files include this header, because its functions are inline.
#pragma once

#include "core/body/dual_frame.hpp"
#include "core/body/euler_parameters.hpp"
#include "core/constraint/single_row.hpp"

namespace mbsopt {

// A body-fixed vector x = A s along the motion and under a virtual displacement.
using VectorJet = MovedJet<Vector3d>;
inline VectorJet vector_of(const Frame& f, const Vector3d& s) { return {turned(f, s), f.A_eta * s}; }
inline VectorJet separation_of(const Frame& f1, const Frame& f2, const Vector3d& s1, const Vector3d& s2) {
  return {separation(f1, f2, s1, s2), f2.point_eta(s2) - f1.point_eta(s1)};
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

inline RowWeights weights(const Multipliers<1>& z) { return {z.lambda(0), z.mu0(0), z.mu1(0), z.mu2(0)}; }

// The vectors of a primitive.
template <class S>
struct Vectors {
  S s1, s2, s3;
};
template <class V>
struct Row {
  Jet<decltype(dot(V(), V()))> phi;
  V force, moment1, moment2;
};
// (A1 s1)'(A2 s2), which has no force
template <class F, class S>
EIGEN_ALWAYS_INLINE Row<VectorOf<F>> product_row(const F& f1, const F& f2, const S& s1, const S& s2) {
  const Jet<VectorOf<F>> x = turned(f1, s1), y = turned(f2, s2);
  return {product(x, y), {}, moment(f1, s1, y.x), moment(f2, s2, x.x)};
}
// Returns the change of a row for the virtual displacements that the frames hold.
inline double virtual_change(const Row<Vector3d>& row, const Frame& f1, const Frame& f2) {
  return row.moment1.dot(f1.theta_eta) + row.moment2.dot(f2.theta_eta);
}

template <class P>
const Vector3d& third(const P& p) {
  if constexpr (requires { p.s3; }) return p.s3;
  return p.s1;
}
template <class P>
EIGEN_ALWAYS_INLINE Row<Vector3d> row_at(const SingleRow<P>& row, const Frame& f1, const Frame& f2) {
  const P& p = static_cast<const P&>(row);
  return row_of(p, f1, f2, Vectors<const Vector3d&>{p.s1, p.s2, third(p)});
}
template <class P>
void SingleRow<P>::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = row_at(*this, f1, f2).phi.x;
}
template <class P>
void SingleRow<P>::phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = row_at(*this, f1, f2).phi.xd;
}
template <class P>
void SingleRow<P>::phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = row_at(*this, f1, f2).phi.xdd;
}
template <class P>
void SingleRow<P>::jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
  const Row<Vector3d> row = row_at(*this, f1, f2);
  if constexpr (P::kDisplacements == Displacements::none) {
    J1.leftCols<3>().setZero(), J2.leftCols<3>().setZero();
  } else {
    J1.leftCols<3>() = -row.force.transpose(), J2.leftCols<3>() = row.force.transpose();
  }
  J1.rightCols<3>() = row.moment1.transpose(), J2.rightCols<3>() = row.moment2.transpose();
}
template <class P>
void SingleRow<P>::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                           const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
  const P& p = static_cast<const P&>(*this);
  const Vectors<BodyVector> vectors{{p.s1, s.s1}, {p.s2, s.s2}, {third(p), s.s3}};
  const Row<DualVector> row = row_of(p, DualFrame{f1, t1}, DualFrame{f2, t2}, vectors);
  out.phi = lanes(row.phi.x);
  out.phi_dot = lanes(row.phi.xd);
  out.phi_ddot = lanes(row.phi.xdd);
  const Lanes<3> dF = lambda(0) * row.force.d;
  out.load1 << -dF, lambda(0) * row.moment1.d;
  out.load2 << dF, lambda(0) * row.moment2.d;
}

}  // namespace mbsopt
