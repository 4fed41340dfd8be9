// Vector algebra of tangent directions, kLanes at a time. Only the files that evaluate tangents include this header,
// because its functions are inline.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// Lanes of a matrix-vector product M' s, M' given entry by entry.
inline Lanes<3> times(const Lanes<9>& M, const Vector3d& s) {
  Lanes<3> x;
  for (int i = 0; i < 3; ++i) x.row(i) = M.row(3 * i) * s(0) + M.row(3 * i + 1) * s(1) + M.row(3 * i + 2) * s(2);
  return x;
}
inline Lanes<3> transposed_times(const Lanes<9>& M, const Vector3d& z) {
  Lanes<3> x;
  for (int j = 0; j < 3; ++j) x.row(j) = M.row(j) * z(0) + M.row(3 + j) * z(1) + M.row(6 + j) * z(2);
  return x;
}
inline Lanes<1> dot(const Vector3d& a, const Lanes<3>& b) {
  return a(0) * b.row(0) + a(1) * b.row(1) + a(2) * b.row(2);
}
inline Lanes<3> cross(const Vector3d& a, const Lanes<3>& b) {
  Lanes<3> x;
  x.row(0) = a(1) * b.row(2) - a(2) * b.row(1);
  x.row(1) = a(2) * b.row(0) - a(0) * b.row(2);
  x.row(2) = a(0) * b.row(1) - a(1) * b.row(0);
  return x;
}

// G(p)'w (euler_parameters.hpp) in the directions of w, and in those of p.
inline Lanes<4> G_transposed_times_lanes(const Vector4d& p, const Lanes<3>& w) {
  Lanes<4> x;
  const Vector3d e = p.tail<3>();
  x.row(0) = -dot(e, w);
  x.bottomRows<3>() = p(0) * w + cross(e, w);
  return x;
}
inline Lanes<4> G_transposed_lanes_times(const Lanes<4>& p, const Vector3d& w) {
  Lanes<4> x;
  const Lanes<3> e = p.bottomRows<3>();
  x.row(0) = -dot(w, e);
  x.bottomRows<3>() = w * p.row(0) - cross(w, e);
  return x;
}

}  // namespace mbsopt
