// Ipopt: a primal-dual interior point method with a filter line search, for smooth problems with bounds and
// constraints. The Hessian is limited-memory BFGS or the program's own, exact or approximate. Waechter and Biegler,
// Mathematical Programming 106 (2006) 25-57. With MUMPS it is not thread-safe: one run at a time per process.
//
//   IpoptOptions options;
//   options.tolerance = 1e-8;
//   options.progress = [](const NlpProgress& p) { return p.iteration < 50; };
//   NlpResult result = solve_with_ipopt(problem, x_start, options);
#pragma once

#include <functional>
#include <optional>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

struct IpoptOptions {
  double tolerance = 1e-6;             // of the scaled optimality conditions, > 0
  double constraint_tolerance = 1e-8;  // largest violation of a constraint that counts as feasible, unscaled
  int max_iterations = 100;            // >= 0
  int history = 20;                    // pairs kept by the limited-memory Hessian
  std::function<bool(const NlpProgress&)> progress;  // after every iteration; false stops
  bool second_order = false;                         // Hessians of the program, which must have hessians()
  bool gauss_newton = false;                         // incomplete Hessians; changes of gradients correct them
  std::optional<long> max_evaluations = {};          // tested after every iteration
  bool warm_start = false;  // the start is near the solution: hardly any barrier, bounds that it touches stay touched
};

// Never throws because of an evaluation: exceptions of evaluate() are failed evaluations, too.
NlpResult solve_with_ipopt(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const IpoptOptions& options = {});

}  // namespace mbsopt::inline optim
