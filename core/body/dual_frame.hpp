// Formulas of moving bodies that are written once, as templates: in numbers (Frame, Vector3d) they give values, in dual
// numbers (DualFrame, BodyVector) their tangents, too. Their results are vectors V: Vector3d or DualVector. Those in
// numbers are always inlined, so that the compiler leaves out the results that a caller does not take.
//
//   template <class F, class S>
//   auto cosine(const F& f1, const F& f2, const S& s1, const S& s2) { return dot(turned(f1, s1).x, turned(f2, s2).x); }
//
//   lanes(cosine(DualFrame{f1, t1}, DualFrame{f2, t2}, BodyVector{s1}, BodyVector{s2}))    // its tangent
#pragma once

#include <type_traits>

#include "core/body/frame.hpp"
#include "core/body/jet.hpp"
#include "core/body/lanes.hpp"
#include "core/linear/dual_numbers.hpp"

namespace mbsopt {

// A vector with its directions.
struct DualVector {
  Vector3d v = Vector3d::Zero();
  Lanes<3> d = Lanes<3>::Zero();
};
inline DualVector operator+(const DualVector& a, const DualVector& b) { return {a.v + b.v, a.d + b.d}; }
inline DualVector operator-(const DualVector& a, const DualVector& b) { return {a.v - b.v, a.d - b.d}; }
inline DualVector operator-(const DualVector& a) { return {-a.v, -a.d}; }
inline DualVector operator*(double s, const DualVector& a) { return {s * a.v, s * a.d}; }
inline DualVector operator*(const Dual& s, const DualVector& a) {
  return {s.value() * a.v, s.value() * a.d + a.v * lanes(s)};
}
inline Dual dot(const DualVector& a, const DualVector& b) { return dual(a.v.dot(b.v), dot(a.v, b.d) + dot(b.v, a.d)); }

// A vector fixed in a body; without directions (null) it is constant.
struct BodyVector {
  const Vector3d& v;
  const Lanes<3>* d = nullptr;
  operator DualVector() const { return {v, d ? *d : Lanes<3>(Lanes<3>::Zero())}; }
};
struct DualFrame {
  const Frame& f;
  const FrameTangent& t;
};
template <class F>
using VectorOf = std::conditional_t<std::is_same_v<F, Frame>, Vector3d, DualVector>;
template <class F>
using ScalarOf = std::conditional_t<std::is_same_v<F, Frame>, double, Dual>;

// M s from numbers in registers, as in euler_parameters.hpp.
EIGEN_ALWAYS_INLINE Vector3d times(const Matrix3d& M, const Vector3d& s) {
  return {M(0, 0) * s(0) + M(0, 1) * s(1) + M(0, 2) * s(2), M(1, 0) * s(0) + M(1, 1) * s(1) + M(1, 2) * s(2),
          M(2, 0) * s(0) + M(2, 1) * s(1) + M(2, 2) * s(2)};
}
inline DualVector times(const Matrix3d& M, const Lanes<9>& dM, bool still, const BodyVector& s) {
  DualVector x{times(M, s.v), still ? Lanes<3>(Lanes<3>::Zero()) : times(dM, s.v)};
  if (s.d) x.d += M * *s.d;
  return x;
}
// A s, and along the motion
inline Vector3d in_space(const Frame& f, const Vector3d& s) { return times(f.A, s); }
inline DualVector in_space(const DualFrame& f, const BodyVector& s) { return times(f.f.A, f.t.A, f.t.still, s); }
EIGEN_ALWAYS_INLINE Jet<Vector3d> turned(const Frame& f, const Vector3d& s) {
  return {times(f.A, s), times(f.Adot, s), times(f.Addot, s)};
}
EIGEN_ALWAYS_INLINE Jet<DualVector> turned(const DualFrame& f, const BodyVector& s) {
  return {in_space(f, s), times(f.f.Adot, f.t.Adot, f.t.still, s), times(f.f.Addot, f.t.Addot, f.t.still, s)};
}
// r + A s. Tangents hold rddot fixed.
EIGEN_ALWAYS_INLINE Jet<Vector3d> point(const Frame& f, const Vector3d& s) {
  const Jet<Vector3d> x = turned(f, s);
  return {f.r + x.x, f.rdot + x.xd, f.rddot + x.xdd};
}
EIGEN_ALWAYS_INLINE Jet<DualVector> point(const DualFrame& f, const BodyVector& s) {
  Jet<DualVector> x = turned(f, s);
  x.x.v += f.f.r;
  x.xd.v += f.f.rdot;
  x.xdd.v += f.f.rddot;
  if (!f.t.still) {
    x.x.d += f.t.r;
    x.xd.d += f.t.rdot;
  }
  return x;
}
// P2 - P1
template <class F, class S>
EIGEN_ALWAYS_INLINE Jet<VectorOf<F>> separation(const F& f1, const F& f2, const S& s1, const S& s2) {
  const Jet<VectorOf<F>> P1 = point(f1, s1), P2 = point(f2, s2);
  return {P2.x - P1.x, P2.xd - P1.xd, P2.xdd - P1.xdd};
}

// A'F, and the moment s x A'F of a force F at s, in the body's axes.
EIGEN_ALWAYS_INLINE Vector3d in_body(const Frame& f, const Vector3d& F) {
  return {f.A.col(0).dot(F), f.A.col(1).dot(F), f.A.col(2).dot(F)};
}
EIGEN_ALWAYS_INLINE Vector3d moment(const Frame& f, const Vector3d& s, const Vector3d& F) {
  return s.cross(in_body(f, F));
}
inline DualVector in_body(const DualFrame& f, const Vector3d& F) {
  return {in_body(f.f, F), f.t.still ? Lanes<3>(Lanes<3>::Zero()) : transposed_times(f.t.A, F)};
}
inline DualVector in_body(const DualFrame& f, const DualVector& F) {
  DualVector x = in_body(f, F.v);
  x.d += f.f.A.transpose() * F.d;
  return x;
}
template <class V>
DualVector moment(const DualFrame& f, const BodyVector& s, const V& F) {
  const DualVector x = in_body(f, F);
  DualVector m{s.v.cross(x.v), cross(s.v, x.d)};
  if (s.d) m.d -= cross(x.v, *s.d);
  return m;
}

// Adds a force at s to the load of its body, or its directions to those of the load.
inline const Vector3d& load_part(const Vector3d& x) { return x; }
inline const Lanes<3>& load_part(const DualVector& x) { return x.d; }
template <class F, class S, class V, class Load>
void add_force(const F& f, const S& s, const V& force, Load& load) {
  load.template topRows<3>() += load_part(force);
  load.template bottomRows<3>() += load_part(moment(f, s, force));
}

}  // namespace mbsopt
