// The inertia J of a body as six numbers, in the order xx yy zz xy xz yz.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// The gradient of <X, J> in these six numbers.
inline Vec<6> inertia_gradient(const Matrix3d& X) {
  Vec<6> x;
  x << X(0, 0), X(1, 1), X(2, 2), X(0, 1) + X(1, 0), X(0, 2) + X(2, 0), X(1, 2) + X(2, 1);
  return x;
}
// J' x of directions J' of these six numbers.
inline Lanes<3> inertia_tangent_times(const Lanes<6>& J, const Vector3d& x) {
  Lanes<3> y;
  y.row(0) = x(0) * J.row(0) + x(1) * J.row(3) + x(2) * J.row(4);
  y.row(1) = x(0) * J.row(3) + x(1) * J.row(1) + x(2) * J.row(5);
  y.row(2) = x(0) * J.row(4) + x(1) * J.row(5) + x(2) * J.row(2);
  return y;
}

}  // namespace mbsopt
