#include "core/cvodes/cvodes_linear_solver.hpp"

#include <cvodes/cvodes_ls.h>

namespace mbsopt::cvodes {

LinearSolver::LinearSolver(Flow& flow, const Context& context)
    : flow_(flow),
      matrix_(flow.data(), flow.dynamics()),
      y_(flow.states()),
      solver_(SUNLinSolNewEmpty(context)),
      handle_(SUNMatNewEmpty(context)) {
  if (!solver_ || !handle_) throw std::bad_alloc();
  solver_->content = this;
  solver_->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
  solver_->ops->getid = [](SUNLinearSolver) { return SUNLINEARSOLVER_CUSTOM; };
  solver_->ops->solve = [](SUNLinearSolver, SUNMatrix A, N_Vector x, N_Vector b, realtype) {
    return of(A).solve(x, b);
  };
  handle_->content = this;
  handle_->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
}

int LinearSolver::set_up(double t, const Flow::Numbers& y, bool keep_jacobian, booleantype* jacobian_is_new,
                         double gamma) {
  constexpr int kRetry = 1;  // CVODES tries a smaller step
  *jacobian_is_new = keep_jacobian ? SUNFALSE : SUNTRUE;
  return flow_.thrown().keep([&] {
    if (!keep_jacobian) {
      if (!flow_.linearise(t, y)) return kRetry;
      y_ = y;
      matrix_.linearise(t, y_, flow_.angles_at(t), flow_.ydot().tail(y_.size() / 2), flow_.dynamics().lambda());
    }
    return matrix_.factor(gamma) ? 0 : kRetry;
  });
}

int LinearSolver::solve(N_Vector x, N_Vector b) {
  constexpr int kRefinements = 1;  // CVODES takes the solution as exact
  Eigen::Map<Eigen::VectorXd> out = values(x);
  out = values(b);
  for (Eigen::Index first = 0; first < out.size(); first += y_.size()) {
    ++solves_;
    auto of_objective = out.segment(first, y_.size());
    backward_ ? matrix_.solve_transposed(of_objective, kRefinements) : matrix_.solve(of_objective, kRefinements);
  }
  return 0;
}

bool LinearSolver::attach(void* memory) {
  const CVLsLinSysFn assemble = [](realtype t, N_Vector y, N_Vector, SUNMatrix A, booleantype keep, booleantype* is_new,
                                   realtype gamma, void*, N_Vector, N_Vector,
                                   N_Vector) { return of(A).set_up(t, values(y), keep != SUNFALSE, is_new, gamma); };
  return CVodeSetLinearSolver(memory, solver_.get(), handle_.get()) == CV_SUCCESS &&
         CVodeSetLinSysFn(memory, assemble) == CV_SUCCESS;
}

bool LinearSolver::attach_backward(void* memory, int which) {
  backward_ = true;
  const CVLsLinSysFnB assemble = [](realtype t, N_Vector y, N_Vector, N_Vector, SUNMatrix A, booleantype keep,
                                    booleantype* is_new, realtype gamma, void*, N_Vector, N_Vector,
                                    N_Vector) { return of(A).set_up(t, values(y), keep != SUNFALSE, is_new, -gamma); };
  return CVodeSetLinearSolverB(memory, which, solver_.get(), handle_.get()) == CV_SUCCESS &&
         CVodeSetLinSysFnB(memory, which, assemble) == CV_SUCCESS;
}

}  // namespace mbsopt::cvodes
