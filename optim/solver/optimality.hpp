// The distance of a feasible point from a stationary one: the same measure for every solver, and for points without
// one.
//
//   Lagrangian's gradient   r = s f_x + c_x' S y      s, S: the program's f_scale and c_scale, y: multipliers
//   y_i >= 0 near an upper bound of c_i, <= 0 near a lower one, of any sign on an equality, else 0
//
// The multipliers minimise r (non-negative least squares: bounded_linear_least_squares.hpp). A component of r may point
// out of a bound at x. Then
//
//   optimality = max( |P(x - r) - x|_inf, max_i |y_i| S_i slack_i ),       P: projection on the bounds
//
// It is 0 at a Karush-Kuhn-Tucker point. It does not measure feasibility.
//
//   if (optimality(problem, x, point) < 1e-6 && problem.violation(point.c) < 1e-8) ...   // stationary
//
// The multipliers are the prices of the constraints: f falls by y_i S_i/s per unit by which c_i's bound is relaxed.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

// point must hold the values and derivatives at x.
double optimality(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point);

struct Stationarity {
  double distance = 0;          // the optimality
  Eigen::VectorXd multipliers;  // y
  Eigen::VectorXd pulls;        // |y_i S_i c_x,i|_inf: the part of r that constraint i balances
  // Returns whether constraint i holds the objective back: more than the tolerance and the distance would show without
  // it.
  bool binds(Eigen::Index i, double tolerance) const { return pulls(i) > std::max(tolerance, distance); }
};
Stationarity stationarity(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point);

// The constraints that conflict at a point where the sum V of violations is smallest:
//
//   V_x + sum of z_i (gradient of constraint i towards its near bound) + sum of z_k (bound of x_k) = 0,   z >= 0
//
// z is found as above. V falls by z_i per unit by which bound i is relaxed, and by 1 if constraint i itself is
// violated.
struct Conflict {
  Eigen::VectorXd of_constraints;  // z_i; 1 where violated; negative of these for lower bounds
  Eigen::VectorXd of_bounds;       // z_k, negative for lower bounds
  double residual = 0;             // |sum|/|V_x|: near 0 where the point is such a point
};
Conflict conflict(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point, double tolerance);

}  // namespace mbsopt::inline optim
