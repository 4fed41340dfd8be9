// Nonlinear least squares whose variables satisfy equations, c(x) = 0, by the method of multipliers. Each round is a
// Levenberg-Marquardt search on residuals only, so bounds, losses and sparse parts need no further code:
//
//   minimise 1/2 |z|^2 + 1/2 |Omega c + Omega^-1 lambda|^2,      then      lambda += Omega^2 c
//
// Omega = omega W is diagonal, with W_i^-2 = sum_k (c_i,k/D_k)^2 and D_k = |column k of z_x|. At omega = 1 an equation
// weighs as much as the residuals' information on its variables. omega rises by 10 from round to round. So the first
// round passes through points where c is far from zero. Hestenes and Powell: Nocedal and Wright, "Numerical
// Optimization" (2006), section 17.3.
//
//   problem.equalities = 2;                                       // the last two rows of z
//   LeastSquaresResult result = solve_with_equalities(problem, x_start, options);
#pragma once

#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

// For a problem without equations this is solve_least_squares. The last rows of result.point are c.
LeastSquaresResult solve_with_equalities(LeastSquaresProblem& problem, const Eigen::VectorXd& x_start,
                                         const LeastSquaresOptions& options = {});

}  // namespace mbsopt::inline optim
