// Static equilibrium: positions q at which the mechanism, at rest and with its drives held, stays at rest.
//
//   z(q, v = 0, t0) = 0,   Phi(q, t0) = 0              z = (rddot, omegadot) per body, from the equations of motion
//
// From a point on the constraints, pseudo-transient continuation follows the overdamped motion M y' = N'M z to the
// equilibrium of the same valley. N is a basis of the motions that joints and drives leave free, orthonormal in M, and
// xi = N y:
//
//   (sigma I - N'M Z_q N) y = N'M z       sigma falls as long as this predicts the forces along the step
//
// Forces need no potential, and may have kinks: a step ends near a kink, or passes it by little. sigma -> 0 is Newton's
// method. Kelley and Keyes, "Convergence analysis of pseudo-transient continuation", SIAM J. Numer. Anal. 35 (1998).
// The derivative is that of the equations and does not depend on the path:
//   -N'M Z_q N y' = N'M (Z_rho + Z_q xi_p'),  J xi_p' = -Phi_rho,  xi' = xi_p' + N y'
#pragma once

#include <string>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

struct Equilibrium {
  bool ok = false;
  std::string message;     // the remaining acceleration, if it failed
  Eigen::VectorXd q;       // 7n
  Eigen::VectorXd angles;  // branches of followed joint angles, continued on the way
  Eigen::MatrixXd q_rho;   // 7n x P, all parameters
  int iterations = 0;
};

// q_guess must satisfy the constraints. angles holds branches of followed joint angles there.
Equilibrium static_equilibrium(const Mechanism& mechanism, double t, const Eigen::VectorXd& q_guess,
                               const Eigen::VectorXd& angles);
// A sentence on an equilibrium q that is unstable; empty for a stable one.
std::string equilibrium_warning(const Mechanism& mechanism, double t, const Eigen::VectorXd& q,
                                const Eigen::VectorXd& angles);

}  // namespace mbsopt
