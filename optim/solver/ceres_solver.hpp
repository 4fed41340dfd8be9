// Ceres: Levenberg-Marquardt with bounds, for nonlinear least squares. ceres-solver.org, "Solving Non-linear Least
// Squares". Converges fast where the residuals at the solution are small.
//
//   CeresOptions options;
//   options.max_iterations = 50;
//   LeastSquaresResult result = solve_with_ceres(problem, x_start, options);
//   if (result.status != SolverStatus::converged) std::cerr << result.message;
#pragma once

#include <functional>

#include "optim/solver/least_squares.hpp"

namespace mbsopt {

struct CeresOptions {
  double tolerance = 1e-10;                                   // relative change of the cost, and of x, > 0
  int max_iterations = 100;                                   // >= 0
  std::function<bool(const LeastSquaresProgress&)> progress;  // after every iteration; false stops
};

// Never throws for what an evaluation does: exceptions of evaluate() are failed evaluations, too.
LeastSquaresResult solve_with_ceres(LeastSquaresProblem& problem, const Eigen::VectorXd& x_start,
                                    const CeresOptions& options = {});

}  // namespace mbsopt
