// The primitives of a single row share this base. Each has one formula for its row (in its .cpp file), a template:
//
//   row_of(p, f1, f2, s)   Phi with its time derivatives, and J': the moments, and the force on body 2, which is the
//                          opposite of that on body 1
//
// In numbers it gives phi, phi_dot, phi_ddot and jacobian, in dual numbers (dual_frame.hpp) the tangent.
#pragma once

#include "core/constraint/primitive.hpp"

namespace mbsopt {

template <class P>
struct SingleRow {
  static constexpr int kRows = 1;

  void phi(const Frame& f1, const Frame& f2, Vec<1>& out) const;
  void phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const;
  void phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const;
  void jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const;
  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const;
};

}  // namespace mbsopt
