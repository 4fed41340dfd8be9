// A smooth nonlinear program, as every solver here sees it:
//
//   minimise f(x)   subject to   x_lower <= x <= x_upper,   c_lower <= c(x) <= c_upper
//
// Value and derivatives come together, since one simulation gives them all; an evaluation that fails says so in words,
// and the solver shortens its step.
//
//   struct Sphere : NonlinearProgram {
//     Sphere() : NonlinearProgram(2, 0) {}
//     void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override { p.f = x.squaredNorm(), p.f_x = 2 * x; }
//   };
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <string>

#include "optim/solver_outcome.hpp"

namespace mbsopt {

struct NlpPoint {
  bool ok = true;
  std::string message;  // why not
  double f = 0;
  Eigen::VectorXd f_x;  // n
  Eigen::VectorXd c;    // m
  Eigen::MatrixXd c_x;  // m x n
};

struct NonlinearProgram {
  NonlinearProgram(Eigen::Index n, Eigen::Index m)
      : x_lower(Eigen::VectorXd::Constant(n, -std::numeric_limits<double>::infinity())),
        x_upper(-x_lower),
        c_lower(Eigen::VectorXd::Constant(m, -std::numeric_limits<double>::infinity())),
        c_upper(-c_lower),
        c_scale(Eigen::VectorXd::Ones(m)) {}
  virtual ~NonlinearProgram() = default;
  NonlinearProgram(const NonlinearProgram&) = delete;
  NonlinearProgram& operator=(const NonlinearProgram&) = delete;

  // point arrives sized, with zeros. x is within the bounds.
  virtual void evaluate(const Eigen::VectorXd& x, NlpPoint& point) = 0;

  Eigen::Index variables() const { return x_lower.size(); }
  Eigen::Index constraints() const { return c_lower.size(); }
  // The largest amount by which a constraint is violated.
  double violation(const Eigen::VectorXd& c) const {
    if (c.size() == 0) return 0;
    return std::max(0.0, (c_lower - c).cwiseMax(c - c_upper).maxCoeff());
  }

  Eigen::VectorXd x_lower, x_upper, c_lower, c_upper;  // +-infinity where there is none
  double f_scale = 1;                                  // multiplies f where the solver tests convergence
  Eigen::VectorXd c_scale;                             // the same for c; ones
};

// What every solver takes and gives.
struct NlpProgress {
  int iteration = 0;
  double f = 0;
  double violation = 0;   // of the constraints
  double optimality = 0;  // largest entry of the Lagrangian's gradient, as the solver scales it
  const Eigen::VectorXd& x;
};

// x: the solution, or the best point seen: feasible before lower f.
struct NlpResult : SolverOutcome {
  NlpPoint point;  // at x
};

}  // namespace mbsopt
