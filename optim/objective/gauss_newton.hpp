// Gauss-Newton Hessians of objectives: second derivatives but for those of the motion. With e an objective's expression
// over u = (rho, sensors), and U = du/drho by a tangent-linear run,
//
//   running, terminal, samples     sum of w U' e_uu U          exact: + sum of w e_s s_rhorho, which is left out
//   rms_of, maximum_of             the chain rule of sqrt(I/T), log(I/T)/k with I, I_rho and I_rhorho as above
//   parameters_only                exact
//
// (the generalised Gauss-Newton matrix of Schraudolph, Neural Computation 14 (2002) 1723-1738). Of a sum of squares of
// sensors less their wanted values it is the textbook's 2 J'J; positive semidefinite wherever e is convex in u; and
// near the exact one where the wanted motion is met, e_s = 0. It costs one tangent-linear run, exact ones cost several
// per variable.
//
//   const GaussNewton H = gauss_newton(evaluator, evaluator.gradients(rho));
//   if (H.ok) H.of[0];     // of the first objective, variable x variable
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/objective/evaluator.hpp"

namespace mbsopt {

struct GaussNewton {
  bool ok = false;
  std::string message;              // why not, in words
  std::vector<Eigen::MatrixXd> of;  // per objective
};

// On the steps of an evaluation that is ok, integrals by three Gauss points per step on the dense output. Throws
// std::invalid_argument for objectives written in C++, which say nothing of second derivatives, and integrators of
// CVODES.
GaussNewton gauss_newton(const Evaluator& evaluator, const Evaluation& at);

}  // namespace mbsopt
