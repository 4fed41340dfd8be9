// The step of sequential quadratic programming, from the values and derivatives at a point:
//
//   minimise over d, t, s   g'd + 1/2 d'H d + sum of t_k + 1/2 tau |t|^2 + nu * sum of s_i + 1/2 tau |s|^2
//   subject to              p_k,j + p_k,j,x'd <= t_k,   a_i,j'd - u_i,j <= s_i,   x_lower <= x + d <= x_upper
//
// f may contain extremes k of pieces p_k,j (NlpPiece). Constraint i has one row j, or one for each of its pieces. Its
// largest violation s_i >= 0 costs nu, so that a step exists even if the linear constraints contradict each other.
// Alternatively each row has a violation of its own: such steps come farther into what limits allow, unless pieces of
// one limit contradict each other. The dual problem has simple bounds only:
//
//   minimise over y   1/2 |L^-1 (g + A'y)|^2 + u'y + delta/2 |y|^2,    0 <= y <= nu,    H = L L'
//
// with 1/tau times the square of what the multipliers of an extreme differ from 1, or those of a constraint exceed nu,
// added. It is a linear least-squares problem within bounds. Rows join when the step before broke them: most never do.
// delta lets a row give way by delta y, less than any tolerance; so dependent rows do no harm.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

// One linear inequality a'd <= u, or an equation, with what it stands for.
struct SqpRow {
  Eigen::VectorXd a;
  double u = 0;
  Eigen::Index row = 0;  // as in NlpPiece
  int piece = -1;        // in NlpPoint::pieces; -1: the constraint itself
  double sign = 1;       // -1: of a lower bound
  bool is_equality = false;
};

struct SqpStep {
  bool ok = false;  // H was positive definite
  Eigen::VectorXd d;
  Eigen::VectorXd y;  // per row, >= 0 but for equations
};

// Objective and constraints scaled as the program says.
struct SqpModel {
  SqpModel(const NonlinearProgram& problem, const Eigen::VectorXd& x, const NlpPoint& point);

  enum class Violations { of_rows, of_constraints };
  SqpStep step(const Eigen::MatrixXd& H, double nu, Violations violations) const;
  double objective(const Eigen::VectorXd& d) const;  // its change, linear
  double violation(const Eigen::VectorXd& d) const;  // sum over the constraints, linear
  // Moves the constraints by what their values at x + d differ from the linear ones: a second-order correction.
  void correct(const NonlinearProgram& problem, const Eigen::VectorXd& d, const NlpPoint& there);

  Eigen::VectorXd g;  // of f without its extremes
  std::vector<SqpRow> rows;
  Eigen::VectorXd lower, upper;  // of d
};

// Sum of the violations of the constraints, in their scaled sizes.
double scaled_violation(const NonlinearProgram& problem, const NlpPoint& point);

}  // namespace mbsopt::inline optim
