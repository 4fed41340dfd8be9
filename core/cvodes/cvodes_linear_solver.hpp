// The matrix of Newton's iteration in an implicit multistep method, I - gamma f_y, as a direct linear solver of
// SUNDIALS: CVODES decides when f_y is evaluated anew and when its factor is kept. The forward run solves (I - gamma
// f_y) x = b. The right-hand side of the adjoint is -f_y'lambda per objective, so it solves (I + gamma f_y')x = b for
// each objective's part of the vector.
#pragma once

#include "core/cvodes/cvodes_flow.hpp"
#include "core/step/shifted_system.hpp"

namespace mbsopt::cvodes {

class LinearSolver {
 public:
  LinearSolver(Flow& flow, const Context& context);
  LinearSolver(const LinearSolver&) = delete;
  LinearSolver& operator=(const LinearSolver&) = delete;

  bool attach(void* memory);                      // to a forward integration
  bool attach_backward(void* memory, int which);  // to a backward one
  long factorisations() const { return matrix_.factorisations(); }
  long solves() const { return solves_; }

 private:
  static LinearSolver& of(SUNMatrix A) { return *static_cast<LinearSolver*>(A->content); }
  int set_up(double t, const Flow::Numbers& y, bool keep_jacobian, booleantype* jacobian_is_new, double gamma);
  int solve(N_Vector x, N_Vector b);

  Flow& flow_;
  ShiftedSystem matrix_;
  Eigen::VectorXd y_;
  Owner<SUNLinearSolver> solver_;
  Owner<SUNMatrix> handle_;
  bool backward_ = false;
  long solves_ = 0;
};

}  // namespace mbsopt::cvodes
