// Second derivatives of objectives by parameters: full Hessians, and their products with a direction.
//
// Nothing is differentiated twice by hand: this is NOT forward over adjoint. It differences the exact discrete gradient
// (adjoint or TLM) along a direction d. Each run takes the accepted steps of the run at rho:
//
//   F(h) = psi_rho(rho + h d), steps frozen       H d = F'(0), by a ladder of differences (difference_ladder.hpp)
//
// On frozen steps F is the gradient of one smooth function psi. So H is symmetric except for the error of the
// differences, which |H - H'| measures. A Hessian takes some 4 to 16 gradients per parameter, of all objectives
// together.
//
//   Evaluator evaluator(problem.scene, objectives_of(problem), {"k1", "L01"}, {GradientMethod::adjoint});
//   const Hessians H = hessians(evaluator, evaluator.start());
//   if (!H.ok) std::cerr << H.message;
//   H.of[0].value(0, 1), H.of[0].error(0, 1);        // of the first objective
//   hessian_products(evaluator, evaluator.start(), d).product.row(0);   // H d, for 4 to 16 gradients
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {

struct HessianOptions {
  // The largest step, relative to the parameter's size (typical_size). In a direction, its largest component in sizes
  // changes by so much. It is smaller if bounds are nearer, and goes to one side only if the point lies on a bound.
  double relative_step = 1e-2;
  int rungs = 8;          // at most; steps, each half of the one before
  double enough = 1e-10;  // ends a ladder: error in H d, relative to the larger of H d and the gradient (in sizes)
  std::function<bool(int done, int of)> progress;  // after each parameter; false abandons
};

// H d per objective.
struct HessianProducts {
  bool ok = false;
  std::string message;      // why not, in words
  Eigen::MatrixXd product;  // objective x variable
  Eigen::MatrixXd error;    // estimated
  long gradients = 0;       // evaluated, that at the point itself not counted
};

struct ObjectiveHessian {
  Eigen::MatrixXd value;  // variable x variable, the mean of what both orders of differentiation give
  Eigen::MatrixXd error;  // estimated: the largest of the two ladders' errors and of |H_pq - H_qp|
  // The largest error and the largest entry, both times the sizes of their parameters, so that entries of all units
  // compare.
  double largest_error = 0, largest_entry = 0;
  double asymmetry = 0;     // the part of largest_error that is |H_pq - H_qp|
  double gradient = 0;      // the gradient's largest entry times its parameter's size
  double relative() const;  // largest_error/largest_entry; 0 where no error is
};

struct Hessians {
  bool ok = false;
  std::string message;               // why not, in words
  std::vector<ObjectiveHessian> of;  // per objective
  GradientMethod method = GradientMethod::adjoint;
  long gradients = 0;  // evaluated, that at the point itself not counted
  double wall_seconds = 0;
};

// Throws std::invalid_argument if there are no second derivatives: CVODES' steps cannot be frozen, and gradients must
// not be differences or CVODES' own.
void require_second_order(const Scene& scene, GradientMethod method);

// Uses the evaluator's method (automatic: its choice for a gradient) and its variables.
Hessians hessians(Evaluator& evaluator, const Eigen::VectorXd& rho, const HessianOptions& options = {});
// d has an entry per variable.
HessianProducts hessian_products(Evaluator& evaluator, const Eigen::VectorXd& rho, const Eigen::VectorXd& d,
                                 const HessianOptions& options = {});

// The method in words, for results: "central differences (one-sided on a bound) of the adjoint gradient on frozen ...".
std::string hessian_method(GradientMethod method);

}  // namespace mbsopt::inline optim
