// The matrix of Newton's iteration in an implicit multistep method, I - gamma f_y, and its transpose, at a state of the
// flow (shifted_system.hpp).
#pragma once

#include "core/cvodes/cvodes_flow.hpp"
#include "core/step/shifted_system.hpp"

namespace mbsopt::cvodes {

class NewtonMatrix {
 public:
  explicit NewtonMatrix(Flow& flow);
  NewtonMatrix(const NewtonMatrix&) = delete;  // its system refers to its Jacobian
  NewtonMatrix& operator=(const NewtonMatrix&) = delete;

  bool linearise(double t, const Flow::Numbers& y);  // f_y at this state
  bool factor(double gamma);                         // false where it is not finite or singular
  // x is the right-hand side on entry and the solution on return. It is refined once, because CVODES takes it as exact.
  void solve(Eigen::Ref<Eigen::VectorXd> x) { system_.solve(x, 1); }
  void solve_transposed(Eigen::Ref<Eigen::VectorXd> x) { system_.solve_transposed(x, 1); }
  long factorisations() const { return system_.factorisations(); }

 private:
  Flow& flow_;
  StageEquations equations_;
  MotionJacobian jacobian_;
  MotionJacobian::Values values_;
  ShiftedSystem system_;
  Eigen::VectorXd y_;
};

}  // namespace mbsopt::cvodes
