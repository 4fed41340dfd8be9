#include "core/dynamics/motion_solver.hpp"

#include <limits>

namespace mbsopt {

MotionSolver::MotionSolver(const Mechanism& mechanism, const FormulationSettings& settings)
    : dynamics_(mechanism, settings) {
  const MechanismData& d = mechanism.data();
  const Eigen::Index states = mechanism.states();
  y_.setConstant(states, std::numeric_limits<double>::quiet_NaN());
  for (Eigen::VectorXd* x : {&ydot_, &w_, &y_bar_}) x->setZero(states);
  theta_bar_.setZero(d.slots());
  rho_bar_.setZero(d.rho.size());
  for (Motion* m : {&motion_, &bar_}) {
    m->z.assign(static_cast<std::size_t>(d.n), Vec<6>::Zero());
    m->lambda.setZero(d.m);
  }
}

const Motion& MotionSolver::motion(const StatePoint& at) {
  if (at.t == t_ && at.y == y_) return motion_;
  t_ = at.t;
  y_ = at.y;
  linearised_ = false;
  if (dynamics_.evaluate(at.t, at.y, at.angles, ydot_)) {
    motion_.z = dynamics_.z();
    motion_.lambda = dynamics_.lambda();
  } else {  // marks numbers that cannot be computed
    for (Vec<6>& z : motion_.z) z.setConstant(std::numeric_limits<double>::quiet_NaN());
    motion_.lambda.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return motion_;
}

void MotionSolver::fold_bar(const StatePoint& at, Eigen::Ref<Eigen::VectorXd> y_bar,
                            Eigen::Ref<Eigen::VectorXd> rho_bar) {
  motion(at);
  if (!linearised_) dynamics_.linearise_here();
  linearised_ = true;
  y_bar_.setZero();
  theta_bar_.setZero();
  rho_bar_.setZero();
  dynamics_.add_adjoint(w_, y_bar_, theta_bar_, rho_bar_, &bar_);
  y_bar += y_bar_;
  rho_bar += rho_bar_;
  dynamics_.data().add_to_rho(theta_bar_, rho_bar);
  for (Vec<6>& z : bar_.z) z.setZero();
  bar_.lambda.setZero();
}

}  // namespace mbsopt
