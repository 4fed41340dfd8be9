// Sequential quadratic programming with the damping of Levenberg and Marquardt, for programs of few variables whose
// evaluations are simulations. Each step minimises the model of sqp_step.hpp with
//
//   H = B + lambda D^2,   D_k^2 = B_kk or more,     merit  phi = f + nu * sum of violations
//
// lambda falls when phi falls as the model says, and rises when a step is refused. A refused step that broke limits is
// tried once more on limits shifted by what they bent (second-order correction). nu is what the limits need.
//
// B is the Hessian that the program gives, where it gives one (Gauss-Newton's), or that of the Lagrangian learnt by
// damped BFGS: whichever foretold the last change of phi better. Nocedal and Wright, "Numerical Optimization" (2006),
// chapters 10 and 18; R. Fletcher, "Second order corrections for non-differentiable optimization", Springer Lecture
// Notes in Mathematics 912 (1982) 85 for the extremes.
//
//   SqpOptions options;
//   NlpResult result = solve_with_sqp(program, x_start, options);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

struct SqpOptions {
  double tolerance = 1e-6;  // of the optimality (optimality.hpp)
  double constraint_tolerance = 1e-8;
  int max_iterations = 500;
  double first_radius = 0.05;  // of steps: a search from there stays in the valley of its start
  std::optional<long> max_evaluations = {};
  bool has_hessians = false;                              // whether problem.hessians() is worth its cost
  std::function<bool(const NlpProgress&)> progress = {};  // after every iteration; false stops
};

NlpResult solve_with_sqp(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const SqpOptions& options = {});

}  // namespace mbsopt::inline optim
