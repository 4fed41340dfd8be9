// Static equilibrium: positions q at which the mechanism, at rest and with its drives held, stays at rest.
//
//   z(q, v = 0, t0) = 0,   Phi(q, t0) = 0              z = (rddot, omegadot) per body, from the equations of motion
//
// From a point on the constraints, pseudo-transient continuation follows the overdamped motion to the nearest
// equilibrium along it. N is an orthonormal basis of the motions that joints and drives leave free, and xi = xi_p + N
// y:
//
//   N'M (sigma I - Z_q) N y = N'M (z + Z_q xi_p),   J xi_p = -Phi,   sigma falling with the remaining acceleration
//
// sigma -> 0 is Newton's method. Kelley and Keyes, "Convergence analysis of pseudo-transient continuation", SIAM J.
// Numer. Anal. 35 (1998). The derivative is that of these equations and does not depend on the path:
//   -N'M Z_q N y' = N'M (Z_rho + Z_q xi_p'),  J xi_p' = -Phi_rho.
#pragma once

#include <string>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

struct Equilibrium {
  bool ok = false;
  std::string message;    // the remaining acceleration, if it failed
  Eigen::VectorXd q;      // 7n
  Eigen::MatrixXd q_rho;  // 7n x P, all parameters
  int iterations = 0;
};

// q_guess must satisfy the constraints. angles holds branches of followed joint angles there.
Equilibrium static_equilibrium(const Mechanism& mechanism, double t, const Eigen::VectorXd& q_guess,
                               const Eigen::VectorXd& angles);

}  // namespace mbsopt
