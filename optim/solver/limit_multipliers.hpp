// Nonlinear least squares within limits of further functions, c_lower <= c(x) <= c_upper, by the method of multipliers.
// Each round is a Levenberg-Marquardt search that learns the second-order term, since limits leave residuals large:
//
//   minimise 1/2 |z|^2 + 1/2 w^2 |s - P(s)|^2,   s = c + l/w^2,      then      l <- w^2 (s - P(s))
//
// P moves s into the limits, so l_i is zero if limit i is inactive. At the start of a round w = 0.15 |z|: a limit that
// is violated by its own size then costs 2 % of the squares at any point. Rounds end when c = P(s): the limits hold,
// and multipliers act only at them. R. T. Rockafellar, "A dual approach to solving nonlinear programming problems by
// unconstrained optimization", Mathematical Programming 5 (1973) 354; Nocedal and Wright, "Numerical Optimization"
// (2006), section 17.4.
//
//   struct Limited : LeastSquaresProblem { ... };                 // the last rows of z are c
//   LeastSquaresResult result = solve_within_limits(problem, c_lower, c_upper, x_start, options);
#pragma once

#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

// c is in units of the size of its limits. Without limits this is solve_least_squares. The last rows of result.point
// are c.
LeastSquaresResult solve_within_limits(LeastSquaresProblem& problem, const Eigen::VectorXd& c_lower,
                                       const Eigen::VectorXd& c_upper, const Eigen::VectorXd& x_start,
                                       const LeastSquaresOptions& options = {});

}  // namespace mbsopt::inline optim
