// Gauss-Newton Hessians of objectives: second derivatives without those of the motion. e is an objective's expression
// over u = (rho, sensors), and a tangent-linear run gives U = du/drho:
//
//   running, terminal, samples     sum of w U' e_uu U          exact: + sum of w e_s s_rhorho, which is left out
//   rms_of, maximum_of             the chain rule of sqrt(I/T), log(I/T)/k with I, I_rho and I_rhorho as above
//   parameters_only                exact
//
// This is the generalised Gauss-Newton matrix of Schraudolph, Neural Computation 14 (2002) 1723-1738. For a sum of
// squares of sensors less their wanted values it is the textbook's 2 J'J. It is positive semidefinite wherever e is
// convex in u. It is near the exact Hessian where the wanted motion is met, e_s = 0. It costs one tangent-linear run;
// an exact Hessian costs several per variable.
//
//   const Hessians H = gauss_newton(evaluator, evaluator.gradients(rho));
//   if (H.ok) H.of[0].value;     // of the first objective, variable x variable
#pragma once

#include "optim/objective/hessian.hpp"

namespace mbsopt::inline optim {

// Uses the steps of the evaluation, with three Gauss points per step on the dense output for integrals. Errors of the
// matrices are not known. Throws std::invalid_argument for objectives written in C++, which have no second derivatives,
// and for CVODES' integrators.
// objectives: only the first ones; 0: all.
Hessians gauss_newton(const Evaluator& evaluator, const Evaluation& at, std::size_t objectives = 0);

}  // namespace mbsopt::inline optim
