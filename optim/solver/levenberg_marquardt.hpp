// Levenberg-Marquardt within bounds, for nonlinear least squares. It converges fast if the residuals at the solution
// are small.
//
//   step d:   minimise |z + J d|^2 + lambda |D d|^2   subject to   x_lower <= x + d <= x_upper,   D_k = |column k of J|
//
// An active set solves this problem exactly in each step (bounded_linear_least_squares.hpp). So bounds that are active
// at the solution cost no further evaluations, and near it the convergence is that without bounds: Kanzow, Yamashita
// and Fukushima, Journal of Computational and Applied Mathematics 172 (2004) 375. The damping lambda falls after a step
// that met the model's promise, by the rule of Nielsen, report IMM-REP-1999-05, Technical University of Denmark. After
// another step it rises until the step is shortened to the minimum of a parabola along it.
//
// If the problem declares which residuals depend on which variables, each part is reduced to a triangle, and the step
// takes their sparse QR.
//
// With a loss, or with eliminated sigmas, the cost of the residuals is not a square. The step minimises this cost of
// the linear residuals, by weights (LeastSquaresProblem::weights) of the residuals after the step:
//   minimise cost(z + J d) + lambda |D d|^2/2:   d <- the step above with the weights at z + J d,   until d is settled
// The costs are concave in the squares, so each d lowers them (Hunter and Lange, The American Statistician 58 (2004)
// 30). With the weights at z alone the convergence would be linear if residuals of several scales disagree.
//
// The cost jumps where the sequence of an integrator's steps changes. The search ends if the error of a step's promise
// does not fall with the step's length, and exceeds the promise.
//
//   LeastSquaresOptions options;
//   options.max_iterations = 50;
//   LeastSquaresResult result = solve_least_squares(problem, x_start, options);
//   if (result.status != SolverStatus::converged) std::cerr << result.message;
#pragma once

#include <functional>
#include <optional>

#include "optim/solver/least_squares.hpp"

namespace mbsopt::inline optim {

// Errors of the simulation may amount to this part of the cost. At a minimum, with rtol 1e-5, the derivatives promise
// less than 1e-8 of the cost of the start. In front of failed points, or with wrong derivatives, they promise most of
// it.
inline constexpr double kSimulationNoise = 1e-4;

struct LeastSquaresOptions {
  double tolerance = 1e-10;                                   // relative change of the cost, and of x, > 0
  int max_iterations = 100;                                   // >= 0
  std::function<bool(const LeastSquaresProgress&)> progress;  // after every iteration; false stops
  std::optional<long> max_evaluations = {};                   // > 0, that of the start counted
};

// Moves x_start into the bounds. Never throws because of an evaluation: exceptions of evaluate() are failed
// evaluations, too.
LeastSquaresResult solve_least_squares(LeastSquaresProblem& problem, const Eigen::VectorXd& x_start,
                                       const LeastSquaresOptions& options = {});

}  // namespace mbsopt::inline optim
