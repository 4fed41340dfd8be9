// Linear least squares within bounds, solved exactly by an active set:
//
//   minimise 1/2 |A d - b|^2   subject to   lower <= d <= upper          A of full column rank, lower <= 0 <= upper
//
// Variables are free or held at a bound. The free ones take their least-squares solution. If it leaves the bounds, they
// go as far as the first bound, which then holds its variable. At a solution within the bounds, the held variable whose
// gradient points inwards most is released. Each turn lowers the sum, so no set of held variables occurs twice. Stark
// and Parker, Computational Statistics 10 (1995) 129; Lawson and Hanson, "Solving Least Squares Problems" (1974),
// chapter 23.
//
//   const VectorXd d = bounded_linear_least_squares(A, b, x_lower - x, x_upper - x);
#pragma once

#include <Eigen/Core>

#include "optim/solver/row_blocks.hpp"

namespace mbsopt::inline optim {

// Held variables have exactly the value of their bound.
Eigen::VectorXd bounded_linear_least_squares(const RowBlocks& A, const Eigen::VectorXd& b, const Eigen::VectorXd& lower,
                                             const Eigen::VectorXd& upper);

}  // namespace mbsopt::inline optim
