// (I - gamma f_y) x = b of the ordinary differential equation y' = f(t, y), y = (q, v), by the one-stage matrix in the
// accelerations (stage_matrix.hpp):  a = f_v-part of x solves the linearised equations of motion at
//   q' = b_q + gamma b_v + gamma^2 a,   v' = b_v + gamma a,    and   x = (b_q + gamma x_v, b_v + gamma a).
// Newton's method of a linear multistep method, Rosenbrock stages, and the filter of stiff error estimates.
#pragma once

#include "core/step/stage_matrix.hpp"

namespace mbsopt {

class ShiftedSystem {
 public:
  ShiftedSystem(const MechanismData& data, SpatialDynamics& dynamics);
  ShiftedSystem(const ShiftedSystem&) = delete;  // its matrix refers to its Jacobian
  ShiftedSystem& operator=(const ShiftedSystem&) = delete;

  // f_y at a motion that solves the equations.
  void linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                 const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  // Factors the matrix unless it is the last one. False: it is not finite, or singular.
  bool factor(double gamma);
  // Solves in place, for 14 n x at most kLanes numbers.
  void solve(Eigen::Ref<Eigen::MatrixXd> x, int refinements = 0);
  void solve_transposed(Eigen::Ref<Eigen::MatrixXd> x, int refinements = 0);
  long factorisations() const { return matrix_.factorisations(); }
  StageEquations& equations() { return equations_; }
  long places() const { return equations_.places(); }
  MotionJacobian& jacobian() { return jacobian_; }
  const MotionJacobian::Values& values() const { return values_; }  // at that motion

 private:
  StageEquations equations_;
  MotionJacobian jacobian_;
  MotionJacobian::Values values_;
  StageMatrix matrix_;
  double gamma_ = 0;
  bool factored_ = false;  // with gamma_ and values_
  Eigen::Index half_;
  Eigen::MatrixXd one_ = Eigen::MatrixXd::Ones(1, 1), r_, y_;
};

}  // namespace mbsopt
