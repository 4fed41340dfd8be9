// Euler parameters p = (e0, e): the homogeneous quadratic rotation A(p), its bilinear derivative, angular velocity.
//
//   A(p)    = (e0^2 - e'e) I + 2 e e' + 2 e0 skew(e)         a rotation where p'p = 1, |p|^2 times one elsewhere
//   B(p, w) = dA(p)[w]: bilinear and symmetric, B(p, p) = 2 A(p)
//   N(p, s) = d(A(p) s)/dp  (3x4):  N(p, s) w = B(p, w) s = N(w, s) p
//   N_transposed(p, s) = d(A(p)'s)/dp
//   K(X)    = the symmetric 4x4 with <X, A(p)> = 1/2 p'K(X)p, so that <X, B(p, w)> = p'K(X)w
//   omega_B = 2 G(p) pdot,  pdot = 1/2 G(p)' omega_B;  A(p) skew(omega_B) = B(p, 1/2 G(p)' omega_B) for every p
//
// G is the body-frame matrix [-e, -skew(e) + e0 I] of Nikravesh, "Computer-Aided Analysis of Mechanical Systems"
// (1988), section 6.2. All of these are polynomials and hold off the unit sphere, where Runge-Kutta stages lie.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// The entries are computed from numbers in registers: expressions of e would be stored and read back from memory.
inline Matrix3d A(const Vector4d& p) {
  const double e0 = p(0), e1 = p(1), e2 = p(2), e3 = p(3);
  const double d = e0 * e0 - (e1 * e1 + e2 * e2 + e3 * e3);
  Matrix3d R;
  R(0, 0) = d + 2 * e1 * e1;
  R(1, 0) = 2 * (e1 * e2 + e0 * e3);
  R(2, 0) = 2 * (e1 * e3 - e0 * e2);
  R(0, 1) = 2 * (e1 * e2 - e0 * e3);
  R(1, 1) = d + 2 * e2 * e2;
  R(2, 1) = 2 * (e2 * e3 + e0 * e1);
  R(0, 2) = 2 * (e1 * e3 + e0 * e2);
  R(1, 2) = 2 * (e2 * e3 - e0 * e1);
  R(2, 2) = d + 2 * e3 * e3;
  return R;
}

inline Matrix3d B(const Vector4d& p, const Vector4d& w) {
  const double e0 = p(0), e1 = p(1), e2 = p(2), e3 = p(3), f0 = w(0), f1 = w(1), f2 = w(2), f3 = w(3);
  const double d = 2 * (e0 * f0 - (e1 * f1 + e2 * f2 + e3 * f3));
  const double s12 = e1 * f2 + e2 * f1, s13 = e1 * f3 + e3 * f1, s23 = e2 * f3 + e3 * f2;
  const double t1 = e0 * f1 + f0 * e1, t2 = e0 * f2 + f0 * e2, t3 = e0 * f3 + f0 * e3;
  Matrix3d R;
  R(0, 0) = d + 4 * e1 * f1;
  R(1, 0) = 2 * (s12 + t3);
  R(2, 0) = 2 * (s13 - t2);
  R(0, 1) = 2 * (s12 - t3);
  R(1, 1) = d + 4 * e2 * f2;
  R(2, 1) = 2 * (s23 + t1);
  R(0, 2) = 2 * (s13 + t2);
  R(1, 2) = 2 * (s23 - t1);
  R(2, 2) = d + 4 * e3 * f3;
  return R;
}

inline Mat<3, 4> N(const Vector4d& p, const Vector3d& s) {
  const double e0 = p(0);
  const Vector3d e = p.tail<3>();
  Mat<3, 4> R;
  R.col(0) = 2 * (e0 * s + e.cross(s));
  Matrix3d X = 2 * (e * s.transpose() - s * e.transpose() - e0 * skew(s));
  X.diagonal().array() += 2 * e.dot(s);
  R.rightCols<3>() = X;
  return R;
}

// d(A(p)'s)/dp: A(p)' = A of the conjugate (e0, -e).
inline Mat<3, 4> N_transposed(const Vector4d& p, const Vector3d& s) {
  Mat<3, 4> R = N(Vector4d(p(0), -p(1), -p(2), -p(3)), s);
  R.rightCols<3>() *= -1;
  return R;
}

inline Mat<4, 4> K(const Matrix3d& X) {
  const double trace = X.trace();
  const Vector3d a(X(2, 1) - X(1, 2), X(0, 2) - X(2, 0), X(1, 0) - X(0, 1));
  Mat<4, 4> R;
  R(0, 0) = 2 * trace;
  R.bottomLeftCorner<3, 1>() = 2 * a;
  R.topRightCorner<1, 3>() = 2 * a.transpose();
  Matrix3d Y = 2 * (X + X.transpose());
  Y.diagonal().array() -= 2 * trace;
  R.bottomRightCorner<3, 3>() = Y;
  return R;
}

inline Mat<3, 4> G(const Vector4d& p) {
  Mat<3, 4> R;
  R.col(0) = -p.tail<3>();
  R.rightCols<3>() = -skew(p.tail<3>());
  R.rightCols<3>().diagonal().array() += p(0);
  return R;
}
// G(p) x for x in R^4 (3 numbers), and G(p)' w for w in R^3 (4 numbers).
inline Vector3d G_times(const Vector4d& p, const Vector4d& x) {
  const Vector3d e = p.tail<3>(), f = x.tail<3>();
  return p(0) * f - x(0) * e - e.cross(f);
}
inline Vector4d G_transposed_times(const Vector4d& p, const Vector3d& w) {
  const Vector3d e = p.tail<3>();
  Vector4d R;
  R(0) = -e.dot(w);
  R.tail<3>() = p(0) * w + e.cross(w);
  return R;
}
// y' G(p)' w as a function of p is p' (this): the adjoint of G_transposed_times in p.
inline Vector4d G_transposed_times_adjoint(const Vector3d& w, const Vector4d& y) {
  const Vector3d f = y.tail<3>();
  Vector4d R;
  R(0) = w.dot(f);
  R.tail<3>() = -y(0) * w + w.cross(f);
  return R;
}

inline Vector3d omega_B(const Vector4d& p, const Vector4d& pdot) { return 2 * G_times(p, pdot); }

}  // namespace mbsopt
