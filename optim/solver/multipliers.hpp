// Nonlinear least squares with conditions on further functions, lower <= c(x) <= upper, by the method of multipliers.
// Each round is a Levenberg-Marquardt search on residuals only, so that bounds, losses and sparse parts need no further
// code:
//
//   minimise 1/2 |z|^2 + 1/2 |Omega (s - P(s))|^2,   s = c + Omega^-2 l,      then      l <- Omega^2 (s - P(s))
//
// P moves s between its limits, so l_i is zero if limit i is inactive. For an equation c_i = 0 the step of l_i is
// Omega_i^2 c_i. R. T. Rockafellar, "A dual approach to solving nonlinear programming problems by unconstrained
// optimization", Mathematical Programming 5 (1973) 354; Nocedal and Wright, "Numerical Optimization" (2006), sections
// 17.3 and 17.4.
//
// Omega is diagonal. Equations begin with the weight W_i^-2 = sum_k (c_i,k/D_k)^2, D_k = |column k of z_x|, as much as
// the residuals' information on their variables. It rises by 10 from round to round. So the first round passes through
// points where c is far from zero. Limits weigh 0.15 |z|: one that is violated by its own size then costs 2 % of the
// squares at any point. They leave residuals large, so that these rounds learn the second-order term.
//
//   problem.equalities = 2;                                       // the last two rows of z
//   LeastSquaresResult result = solve_with_equalities(problem, x_start, options);
//
//   struct Limited : LeastSquaresProblem { ... };                 // the last rows of z are c
//   LeastSquaresResult result = solve_within_limits(problem, c_lower, c_upper, x_start, options);
#pragma once

#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

// The last rows of result.point are c. Without conditions these are solve_least_squares.
LeastSquaresResult solve_with_equalities(LeastSquaresProblem& problem, const Eigen::VectorXd& x_start,
                                         const LeastSquaresOptions& options = {});

// c is in units of the size of its limits.
LeastSquaresResult solve_within_limits(LeastSquaresProblem& problem, const Eigen::VectorXd& c_lower,
                                       const Eigen::VectorXd& c_upper, const Eigen::VectorXd& x_start,
                                       const LeastSquaresOptions& options = {});

}  // namespace mbsopt::inline optim
