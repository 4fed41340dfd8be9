// A nonlinear least-squares problem, in the form of every solver here:
//
//   minimise 1/2 sum rho(z_i(x)^2) + 1/2 sum z_j(x)^2   subject to   x_lower <= x <= x_upper,   z_k(x) = 0
//
// rho is the loss (robust_loss.hpp). `plain` residuals, j, are squared for any loss. The last `equalities` rows, k, are
// no residuals but equations between the variables (multipliers.hpp).
//
// Residuals of a scale group have a common unknown standard deviation s. The fit eliminates it:
//
//   minimise over s:  1/2 sum z_i^2/s^2 + f log s      =>      s^2 = sum z_i^2/f,      cost f/2 (1 + log(sum z_i^2/f))
//
// which is the likelihood of normal noise if f is the number of residuals (Seber and Wild, "Nonlinear Regression"
// (1989), section 2.2). Groups need the squared loss.
//
// Residuals and their Jacobian come together, since one simulation gives both. A failed evaluation reports the reason
// in words, and the solver shortens its step.
//
//   struct Line : LeastSquaresProblem {
//     Line() : LeastSquaresProblem(2, 3) {}
//     void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override { p.z = A * x - b, p.z_x = A; }
//   };
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "optim/solver/robust_loss.hpp"
#include "optim/solver/solver_outcome.hpp"

namespace mbsopt::inline optim {

struct LeastSquaresPoint {
  bool ok = true;
  std::string message;  // why not
  Eigen::VectorXd z;    // N
  Eigen::MatrixXd z_x;  // N x n
};

struct ScaleGroup {
  std::vector<Eigen::Index> rows;
  double freedom = 0;  // f > 0
  double least = 0;    // of s^2, > 0: exact data have no noise
  double squared_scale(const Eigen::VectorXd& z) const;
};

// Rows of z that depend on these variables only.
struct Dependence {
  std::vector<Eigen::Index> rows, variables;
};

struct LeastSquaresProblem {
  LeastSquaresProblem(Eigen::Index variables, Eigen::Index residuals)
      : x_lower(Eigen::VectorXd::Constant(variables, -std::numeric_limits<double>::infinity())),
        x_upper(-x_lower),
        size(residuals) {}
  virtual ~LeastSquaresProblem() = default;
  LeastSquaresProblem(const LeastSquaresProblem&) = delete;
  LeastSquaresProblem& operator=(const LeastSquaresProblem&) = delete;

  // point arrives sized and zeroed.
  virtual void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) = 0;

  Eigen::Index variables() const { return x_lower.size(); }
  double cost(const Eigen::VectorXd& z) const;
  // Returns w with d cost/d z_i = w_i z_i.
  Eigen::VectorXd weights(const Eigen::VectorXd& z) const;
  // Returns d cost/d z_i, residual by residual.
  Eigen::VectorXd pull(const Eigen::VectorXd& z) const;

  Eigen::VectorXd x_lower, x_upper;  // +-infinity where there is none
  Eigen::Index size;                 // N
  Eigen::Index equalities = 0;       // the number of last rows that are zero at the solution
  Eigen::VectorXd closed;            // per equality: |c| that its own errors leave; empty: none
  bool is_integrated = true;         // z has the errors of an integrator; known after an evaluation
  Eigen::Index plain = 0;            // the number of rows before the equalities that ignore the loss
  Loss loss;
  std::vector<ScaleGroup> groups;  // disjoint
  std::vector<Dependence> parts;   // all rows, each once; empty: any row may depend on any variable
};

struct LeastSquaresProgress {
  int iteration = 0;
  double cost = 0;           // as in LeastSquaresProblem::cost
  double gradient_norm = 0;  // largest entry
  double step_norm = 0;
  Eigen::VectorXd x;
  Eigen::VectorXd z;  // at x
};

struct LeastSquaresResult : SolverOutcome {
  LeastSquaresPoint point;    // at x
  Eigen::VectorXd z_initial;  // at the start; empty where that could not be evaluated
  double cost_initial = 0, cost_final = 0;
  double promised = 0;  // part of the cost that a step along one variable would gain by the derivatives
};

}  // namespace mbsopt::inline optim
