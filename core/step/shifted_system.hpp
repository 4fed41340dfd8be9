// (I - gamma f_y) x = b of the ordinary differential equation y' = f(t, y), y = (q, v), by the one-stage matrix in the
// accelerations (stage_matrix.hpp):  a = f_v-part of x solves the linearised equations of motion at
//   q' = b_q + gamma b_v + gamma^2 a,   v' = b_v + gamma a,    and   x = (b_q + gamma x_v, b_v + gamma a).
// Newton's method of a linear multistep method, and the filter of stiff error estimates.
#pragma once

#include "core/step/stage_matrix.hpp"

namespace mbsopt {

class ShiftedSystem {
 public:
  ShiftedSystem(const MechanismData& data, const MotionJacobian& jacobian);

  bool factor(double gamma,
              const MotionJacobian::Values& values);  // values are kept by reference until the next factor
  // Solves in place, for 14 n x at most kLanes numbers.
  void solve(Eigen::Ref<Eigen::MatrixXd> x, int refinements = 0);
  void solve_transposed(Eigen::Ref<Eigen::MatrixXd> x, int refinements = 0);
  long factorisations() const { return matrix_.factorisations(); }

 private:
  const MotionJacobian* jacobian_;
  const MotionJacobian::Values* values_ = nullptr;
  StageMatrix matrix_;
  double gamma_ = 0;
  Eigen::Index half_;
  Eigen::MatrixXd one_ = Eigen::MatrixXd::Ones(1, 1), r_, y_;
};

}  // namespace mbsopt
