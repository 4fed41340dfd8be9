// A smooth nonlinear program, in the form of every solver here:
//
//   minimise f(x)   subject to   x_lower <= x <= x_upper,   c_lower <= c(x) <= c_upper
//
// Value and derivatives come together, since one simulation gives them all. Methods without derivatives ask for values
// alone. A failed evaluation reports the reason in words, and the solver shortens its step.
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
#include <vector>

#include "optim/solver/solver_outcome.hpp"

namespace mbsopt::inline optim {

// The factors of f and c in a solver's tests of convergence.
struct NlpScale {
  double f = 1;
  Eigen::VectorXd c;
};

enum class Wanted { values, derivatives };

// Where f or c_i is the largest, or least, of several functions: one of them, with its value. A search that sees all
// that come near the extreme knows on which side of a kink it is.
struct NlpPiece {
  static constexpr Eigen::Index kObjective = -1;
  Eigen::Index row = 0;  // of c; kObjective - g: of the g-th extreme that f is a sum of
  int side = 1;          // of the largest, -1: of the least
  double value = 0;      // in the size of its part in f or c
  Eigen::VectorXd gradient;
  double mark = 0;  // the nearest mark at another point belongs to the same function
};

struct NlpPoint {
  bool ok = true;
  bool abandoned = false;  // not ok because the user stopped it: that says nothing about x
  std::string message;     // why not
  double f = 0;
  Eigen::VectorXd f_x;  // n
  Eigen::VectorXd c;    // m
  Eigen::MatrixXd c_x;  // m x n
  // Derivatives of f and c are those of their first pieces. Empty where all are smooth.
  std::vector<NlpPiece> pieces;
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

  // point arrives sized and zeroed. x is within the bounds.
  virtual void evaluate(const Eigen::VectorXd& x, NlpPoint& point) = 0;
  // Evaluates f and c alone, if they are cheaper than with derivatives.
  virtual void evaluate_values(const Eigen::VectorXd& x, NlpPoint& point) {
    point.f_x.setZero(x.size());
    point.c_x.setZero(constraints(), x.size());
    evaluate(x, point);
  }
  // A local search went on to x, which it evaluated last: what it tries next is near.
  virtual void moved_to(const Eigen::VectorXd&) {}
  // Sets second derivatives of f, then of each c: n x n each. Returns false if there are none.
  virtual bool hessians(const Eigen::VectorXd&, std::vector<Eigen::MatrixXd>&) { return false; }

  Eigen::Index variables() const { return x_lower.size(); }
  Eigen::Index constraints() const { return c_lower.size(); }
  // The largest amount by which a constraint is violated.
  double violation(const Eigen::VectorXd& c) const {
    if (c.size() == 0) return 0;
    return std::max(0.0, (c_lower - c).cwiseMax(c - c_upper).maxCoeff());
  }

  // The sum of all violations above the tolerance; 0 where none is. It has the kinks of the violations only, so that
  // optimality conditions describe its minimum (optimality.hpp).
  double sum_of_violations(const Eigen::VectorXd& c, double tolerance) const {
    const Eigen::ArrayXd each = (c_lower - c).cwiseMax(c - c_upper).array();
    return (each > tolerance).select(each, 0).sum();
  }

  Eigen::VectorXd x_lower, x_upper, c_lower, c_upper;  // +-infinity where there is none
  double f_scale = 1;                                  // multiplies f where the solver tests convergence
  Eigen::VectorXd c_scale;                             // the same for c; ones
};

// The Hessians at one point.
struct NlpHessians {
  std::vector<Eigen::MatrixXd> of;  // f, and each constraint
};

// The input and output of every solver.
struct NlpProgress {
  int iteration = 0;
  double f = 0;
  double violation = 0;   // of the constraints
  double optimality = 0;  // largest entry of the Lagrangian's gradient, as the solver scales it; NaN: not known
  const Eigen::VectorXd& x;
};

// x is the solution, or the best point found: feasible points come before a lower f.
struct NlpResult : SolverOutcome {
  NlpPoint point;         // at x; not ok where the start could not be evaluated
  std::string algorithm;  // in the words of the library that it comes from
};

}  // namespace mbsopt::inline optim
