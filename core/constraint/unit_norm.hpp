// Unit norm of a body's Euler parameters, one equation per body.   [-]
//   Phi = p'p - 1      Phi_p = 2 p'      Phidot = 2 p'pdot      Phiddot = 2 p'pddot + 2 pdot'pdot
// The dynamics solves it by hand: pddot has the component -(pdot'pdot) p along p (frame.hpp). Assembly and projection
// impose it on positions and velocities.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

struct UnitNorm {
  static double phi(const Vector4d& p) { return p.squaredNorm() - 1; }
  static double phi_dot(const Vector4d& p, const Vector4d& pdot) { return 2 * p.dot(pdot); }
  static Vector4d phi_p(const Vector4d& p) { return 2 * p; }

  // p -> p/|p|: the nearest numbers that satisfy the equation.
  static Vector4d project(const Vector4d& p) { return p / p.norm(); }
};

}  // namespace mbsopt
