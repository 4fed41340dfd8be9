// Linear least squares within bounds, solved exactly by an active set:
//
//   minimise 1/2 |A d - b|^2   subject to   lower <= d <= upper          lower <= 0 <= upper
//
// Variables are free or held at a bound. The free ones take their least-squares solution, by QR with column pivoting:
// sparse, since each row has entries in a few columns only if a problem consists of parts. If the solution leaves the
// bounds, they go as far as the first bound, which then holds its variable. At a solution within the bounds, the held
// variable whose gradient points inwards most is released. Each turn lowers the sum, so no set of held variables occurs
// twice. Stark and Parker, Computational Statistics 10 (1995) 129; Lawson and Hanson, "Solving Least Squares Problems"
// (1974), chapter 23.
//
//   const VectorXd d = bounded_linear_least_squares(A, b, x_lower - x, x_upper - x);
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace mbsopt::inline optim {

// Held variables have exactly the value of their bound. If columns of A are dependent, d is one of the solutions.
Eigen::VectorXd bounded_linear_least_squares(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b,
                                             const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);
Eigen::VectorXd bounded_linear_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                             const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

Eigen::VectorXd column_norms(const Eigen::SparseMatrix<double>& A);

}  // namespace mbsopt::inline optim
