// Newton steps, corrected by the third derivative along them. With d = -H^-1 f_x, one more gradient shows it:
//
//   t = 2 (f_x(x + d) - f_x - H d)          f_xxx[d, d], its difference over the step itself
//
// The step s solves the model with the third derivative along d (a tensor model: Schnabel and Chow, SIAM J. Optim. 1
// (1991) 293-315, there along earlier steps),
//
//   f_x + H s + (beta^2/2) t = 0            beta = (s'H d)/(d'H d), the part of s along d
//   s = beta d - (beta^2/2) (H^-1 t - tau d),   beta = 2/(1 + sqrt(1 + 2 tau)),   tau = (d't)/(d'H d)
//
// and converges cubically where f_xx is positive definite and three times differentiable. Along d it is Euler's method
// for a root of f', and to first order in t Chebyshev's (Traub, "Iterative Methods for the Solution of Equations"
// (1964), chapter 5). For -1 < tau < -1/2 the model's slope has no zero and f keeps falling: then beta = 2, its last
// value.
//
//   if (const auto d = newton_step(problem, x, f_x, H))
//     if (const auto B = third_order_hessian(H, *d, t)) ...     // B s = -f_x: for solvers that take a Hessian
#pragma once

#include <Eigen/Core>
#include <optional>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt {

// The Newton step in the variables that no bound holds; 0 in the others. There is none if H is not positive definite in
// them, or if the step would leave the bounds.
std::optional<Eigen::VectorXd> newton_step(const NonlinearProgram& problem, const Eigen::VectorXd& x,
                                           const Eigen::VectorXd& f_x, const Eigen::MatrixXd& H);

// H, which must be positive definite, updated (BFGS) so that B s = -f_x in the variables that d changes. There is none
// if t is too large for the model: tau <= -1, or s turns by more than 45 degrees off d in the norm of H.
std::optional<Eigen::MatrixXd> third_order_hessian(const Eigen::MatrixXd& H, const Eigen::VectorXd& d,
                                                   const Eigen::VectorXd& t);

}  // namespace mbsopt
