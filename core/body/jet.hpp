// A number or a vector along the motion, with its time derivatives. The formulas hold in space and in the plane, and
// for dual numbers, whose lanes are their tangents.
#pragma once

#include <cmath>

#include "core/linear/dual_numbers.hpp"

namespace mbsopt {

inline double dot(const Vector3d& a, const Vector3d& b) { return a.dot(b); }

template <class X>
struct Jet {
  X x, xd, xdd;
};

// a'b
template <class V>
EIGEN_ALWAYS_INLINE auto product(const Jet<V>& a, const Jet<V>& b) {
  using T = decltype(dot(a.x, b.x));
  return Jet<T>{dot(a.x, b.x), T(dot(a.xd, b.x) + dot(a.x, b.xd)),
                T(dot(a.xdd, b.x) + 2 * dot(a.xd, b.xd) + dot(a.x, b.xdd))};
}

// |d|; all zero if d is, where it has no derivatives.
template <class V>
EIGEN_ALWAYS_INLINE auto length(const Jet<V>& d) {
  using std::sqrt;
  using T = decltype(dot(d.x, d.x));
  const T l2 = dot(d.x, d.x);
  if (!(l2 > 0)) return Jet<T>{T(0), T(0), T(0)};
  const T l = sqrt(l2), ldot = dot(d.x, d.xd) / l;
  return Jet<T>{l, ldot, T((dot(d.x, d.xdd) + dot(d.xd, d.xd) - ldot * ldot) / l)};
}

// atan2(y, x). Eigen's function of dual numbers allocates.
inline double angle_of(double y, double x) { return std::atan2(y, x); }
template <int N>
DualNumber<N> angle_of(const DualNumber<N>& y, const DualNumber<N>& x) {
  const double squares = x.value() * x.value() + y.value() * y.value();
  return {std::atan2(y.value(), x.value()), (x.value() * y.derivatives() - y.value() * x.derivatives()) / squares};
}

// A vector along the motion and under a virtual displacement, or the cotangents of these.
template <class V>
struct MovedJet : Jet<V> {
  V x_eta;
};
// Weights of the scalar  lambda phi_eta + mu0 phi + mu1 phi_dot + mu2 phi_ddot  of a row.
struct RowWeights {
  double lambda = 0, mu0 = 0, mu1 = 0, mu2 = 0;
};
// The cotangent of x in it for phi = x'y.
template <class V>
EIGEN_ALWAYS_INLINE MovedJet<V> product_bar(const MovedJet<V>& y, const RowWeights& z) {
  return {{V(z.lambda * y.x_eta + z.mu0 * y.x + z.mu1 * y.xd + z.mu2 * y.xdd), V(z.mu1 * y.x + (2 * z.mu2) * y.xd),
           V(z.mu2 * y.x)},
          V(z.lambda * y.x)};
}
// The cotangent of d in it for phi = l = |d| > 0, with u = d/l and u_d x = across(x):
//   l_d = u,  (ldot)_d = across(ddot),  (lddot)_d = across(dddot) - 2 ldot across(ddot)/l - c u/l
//   (lddot)_ddot = 2 (ddot - ldot u)/l
template <class V>
MovedJet<V> length_bar(const MovedJet<V>& d, const RowWeights& z) {
  const double l = std::sqrt(dot(d.x, d.x));
  const V u = (1 / l) * d.x;
  const auto across = [&](const V& x) { return V((1 / l) * (x - dot(u, x) * u)); };
  const double ldot = dot(u, d.xd), c = (dot(d.xd, d.xd) - ldot * ldot) / l;
  return {{V(z.lambda * across(d.x_eta) + z.mu0 * u + z.mu1 * across(d.xd) +
             z.mu2 * (across(d.xdd) - (2 * ldot / l) * across(d.xd) - (c / l) * u)),
           V(z.mu1 * u + (2 * z.mu2) * across(d.xd)), V(z.mu2 * u)},
          V(z.lambda * u)};
}

// d/l, or zero without a direction.
template <class V, class T>
EIGEN_ALWAYS_INLINE V direction(const V& d, const T& l) {
  return l > 0 ? V(T(1 / l) * d) : V(0.0 * d);
}

}  // namespace mbsopt
