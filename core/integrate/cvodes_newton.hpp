// The matrix of Newton's iteration in an implicit multistep method, I - gamma f_y, and its transpose, reduced to the
// accelerations: with f = (v, a(t, q, v)),
//   (I - gamma f_y) x = b:    (I - gamma a_v - gamma^2 a_q) x_v = b_v + gamma a_q b_q,     x_q = b_q + gamma x_v
//   (I - gamma f_y)'x = b:    (I - gamma a_v - gamma^2 a_q)'x_v = b_v + gamma b_q,         x_q = b_q + gamma a_q'x_v
// a_q and a_v come from the tangent of the equations of motion, kLanes columns at a time, and are kept dense.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "core/integrate/cvodes_flow.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt::cvodes {

class NewtonMatrix {
 public:
  explicit NewtonMatrix(Flow& flow);

  bool linearise(double t, const Flow::Numbers& y);  // f_y at this state
  bool factor(double gamma);                         // false where it is not finite or singular
  void solve(Eigen::Ref<Eigen::VectorXd> x);         // x: right-hand side in, solution out
  void solve_transposed(Eigen::Ref<Eigen::VectorXd> x);
  long factorisations() const { return factorisations_; }

 private:
  Flow& flow_;
  Eigen::Index half_;
  double gamma_ = 0;
  Eigen::MatrixXd a_q_, a_v_, matrix_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Eigen::VectorXd b_;
  ParameterBlock no_parameters_;
  LaneRows direction_, change_;
  long factorisations_ = 0;
};

}  // namespace mbsopt::cvodes
