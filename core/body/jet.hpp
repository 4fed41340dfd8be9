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

// d/l, or zero without a direction.
template <class V, class T>
EIGEN_ALWAYS_INLINE V direction(const V& d, const T& l) {
  return l > 0 ? V(T(1 / l) * d) : V(0.0 * d);
}

}  // namespace mbsopt
