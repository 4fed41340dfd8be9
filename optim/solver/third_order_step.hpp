// Newton's steps, mended by the third derivative along them. With d = -H^-1 f_x, one more gradient tells of it:
//
//   t = 2 (f_x(x + d) - f_x - H d)          f_xxx[d, d], its difference over the step itself
//
// The step s solves the model that knows the third derivative along d (a tensor model: Schnabel and Chow, SIAM J.
// Optim. 1 (1991) 293-315, there along earlier steps),
//
//   f_x + H s + (beta^2/2) t = 0            beta = (s'H d)/(d'H d), the part of s along d
//   s = beta d - (beta^2/2) (H^-1 t - tau d),   beta = 2/(1 + sqrt(1 + 2 tau)),   tau = (d't)/(d'H d)
//
// and converges cubically where f_xx is positive definite and three times differentiable. Along d it is Euler's method
// for a root of f', to first order in t Chebyshev's (Traub, "Iterative Methods for the Solution of Equations" (1964),
// chapter 5). For -1 < tau < -1/2 the model's slope has no zero, f falls on: beta = 2, where the last one was.
//
//   if (const auto d = newton_step(problem, x, f_x, H))
//     if (const auto B = third_order_hessian(H, *d, t)) ...     // B s = -f_x: for solvers that take a Hessian
#pragma once

#include <Eigen/Core>
#include <optional>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt {

// Over the variables that no bound holds; 0 in the others. None where H is not positive definite in them, or the step
// would leave the bounds.
std::optional<Eigen::VectorXd> newton_step(const NonlinearProgram& problem, const Eigen::VectorXd& x,
                                           const Eigen::VectorXd& f_x, const Eigen::MatrixXd& H);

// H, which must be positive definite, updated (BFGS) so that B s = -f_x in the variables that d changes. None where t
// is too large for the model: tau <= -1, or s would turn by more than 45 degrees off d in the norm of H.
std::optional<Eigen::MatrixXd> third_order_hessian(const Eigen::MatrixXd& H, const Eigen::VectorXd& d,
                                                   const Eigen::VectorXd& t);

}  // namespace mbsopt
