// The step of sequential quadratic programming, from the values and derivatives at a point:
//
//   minimise over d, t   g'd + 1/2 d'H d + sum of t_k + 1/2 tau |t|^2 + nu * sum of the violations of  a_i'd <= u_i
//   subject to           p_k,j + p_k,j,x'd <= t_k,   x_lower <= x + d <= x_upper
//
// The rows are those of all constraints; f may contain extremes k of pieces p_k,j (NlpPiece). A violation costs nu, so
// that a step exists even if the linear constraints contradict each other. The dual problem has simple bounds only:
//
//   minimise over y   1/2 |L^-1 (g + A'y)|^2 + u'y + delta/2 |y|^2,    0 <= y <= nu,    H = L L'
//
// and is a linear least-squares problem within bounds. Rows join when the step before broke them: most never do.
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

  SqpStep step(const Eigen::MatrixXd& H, double nu) const;
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
