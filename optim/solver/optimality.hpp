// How far a feasible point is from being stationary: the same yardstick for every solver, and for points that came from
// none.
//
//   Lagrangian's gradient   r = s f_x + c_x' S y      s, S: the program's f_scale and c_scale, y: multipliers
//   y_i >= 0 near an upper bound of c_i, <= 0 near a lower one, of any sign on an equality, else 0
//
// The multipliers are those that make r smallest (non-negative least squares: Lawson and Hanson, "Solving Least Squares
// Problems" (1974), chapter 23), where a component of r may point out of a bound that x touches. Then
//
//   optimality = max( |P(x - r) - x|_inf, max_i |y_i| S_i slack_i ),       P: projection on the bounds
//
// 0 at a Karush-Kuhn-Tucker point. It says nothing about feasibility.
//
//   if (optimality(problem, x, point) < 1e-6 && problem.violation(point.c) < 1e-8) ...   // stationary
//
// The multipliers are the prices of the constraints: f falls by y_i S_i/s per unit by which c_i's bound is eased.
#pragma once

#include <Eigen/Core>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt {

// point: at x, with derivatives.
double optimality(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point);

struct Stationarity {
  double distance = 0;          // the optimality
  Eigen::VectorXd multipliers;  // y
};
Stationarity stationarity(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point);

// What keeps the violated constraints from being satisfied at a point where their sum V of violations is smallest:
//
//   V_x + sum of z_i (gradient of constraint i towards its near bound) + sum of z_k (bound of x_k) = 0,   z >= 0
//
// z is found as above. V falls by z_i per unit by which bound i is eased, by 1 where constraint i is violated itself.
struct Conflict {
  Eigen::VectorXd of_constraints;  // z_i; 1 where violated; negative of these for lower bounds
  Eigen::VectorXd of_bounds;       // z_k, negative for lower bounds
  double residual = 0;             // |sum|/|V_x|: near 0 where the point is such a point
};
Conflict conflict(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point, double tolerance);

// min |A z - b|, z >= 0.
Eigen::VectorXd non_negative_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace mbsopt
