// The linear system of s coupled Runge-Kutta stages in their accelerations and multipliers x_i = (a_i, lambda_i):
//
//   sum_j N_ij x_j = b_i,   N_ij = [i = j] (-r_(a, lambda)) - P_ij r_v - (P^2)_ij r_q      at stage i,   P = h A
//
// since V_i = V*_i + sum_j P_ij a_j and Q_i = Q*_i + sum_j P_ij V_j (Dynamics::residual, MotionJacobian). One sparse
// factor serves Newton's method, the tangents, and transposed the adjoint.
//
// Redundant constraints make N singular, so it is factored with -epsilon added for each multiplier; solve() takes that
// back by refinement, to rounding, so that solve and solve_transposed are transposes of each other.
#pragma once

#include <span>

#include "core/dynamics/motion_jacobian.hpp"
#include "core/dynamics/sparse_lu.hpp"

namespace mbsopt {

class StageMatrix {
 public:
  StageMatrix(const MechanismData& data, const MotionJacobian& jacobian, int stages);

  int stages() const { return stages_; }
  Eigen::Index size() const { return per_stage_ * stages_; }

  // values: of each stage; may be one and the same.
  bool factor(const Eigen::Ref<const Eigen::MatrixXd>& P, std::span<const MotionJacobian::Values* const> values);
  static constexpr int kExact = 3;  // refinements at most for derivatives; Newton's method needs none
  void solve(Eigen::Ref<Eigen::MatrixXd> b, int refinements);  // in place; at most kLanes columns
  void solve_transposed(Eigen::Ref<Eigen::MatrixXd> b, int refinements);
  long factorisations() const { return factorisations_; }

 private:
  template <class Solve>
  void refine(Eigen::Ref<Eigen::MatrixXd> b, int refinements, const Solve& solve);

  const MotionJacobian* jacobian_;
  int stages_;
  Eigen::Index per_stage_;
  SparseLu lu_;
  Eigen::VectorXd epsilon_;  // per row of Phi
  Eigen::MatrixXd correction_, step_, P2_;
  long factorisations_ = 0;
};

}  // namespace mbsopt
