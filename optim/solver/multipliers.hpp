// Nonlinear least squares with equations c(x) = 0 between the variables, by the method of multipliers. Each round is a
// Levenberg-Marquardt search on residuals only, so that bounds, losses and sparse parts need no further code:
//
//   minimise 1/2 |z|^2 + 1/2 |Omega (c + Omega^-2 l)|^2,      then      l <- l + Omega^2 c
//
// R. T. Rockafellar, "A dual approach to solving nonlinear programming problems by unconstrained optimization",
// Mathematical Programming 5 (1973) 354; Nocedal and Wright, "Numerical Optimization" (2006), section 17.3.
//
// Omega is diagonal. An equation begins with the weight W_i^-2 = sum_k (c_i,k/D_k)^2, D_k = |column k of z_x|, as much
// as the residuals' information on its variables. It rises by 10 from round to round. So the first round passes through
// points where c is far from zero.
//
//   problem.equalities = 2;                                       // the last two rows of z
//   LeastSquaresResult result = solve_with_equalities(problem, x_start, options);
#pragma once

#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

// The last rows of result.point are c. Without equations this is solve_least_squares.
LeastSquaresResult solve_with_equalities(LeastSquaresProblem& problem, const Eigen::VectorXd& x_start,
                                         const LeastSquaresOptions& options = {});

}  // namespace mbsopt::inline optim
