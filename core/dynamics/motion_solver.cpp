#include "core/dynamics/motion_solver.hpp"

#include <limits>

#include "core/dynamics/planar_dynamics.hpp"

namespace mbsopt {

MotionSolver::MotionSolver(const Mechanism& mechanism, const FormulationSettings& settings)
    : mechanism_(mechanism),
      settings_(settings),
      has_plane_(mechanism.data().planar && settings.type != FormulationType::penalty) {
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

MotionSolver::~MotionSolver() = default;

const Motion& MotionSolver::motion(const StatePoint& at, MotionPart part) {
  if (!has_plane_) part = MotionPart::all;
  if (at.t != t_ || at.y != y_) {
    t_ = at.t;
    y_ = at.y;
    solved_.reset();
  }
  if (is_solved(part)) return motion_;
  solved_ = part;
  linearised_ = false;
  if (!solve(at)) {  // marks numbers that cannot be computed
    for (Vec<6>& z : motion_.z) z.setConstant(std::numeric_limits<double>::quiet_NaN());
    motion_.lambda.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return motion_;
}

bool MotionSolver::solve(const StatePoint& at) {
  if (*solved_ == MotionPart::in_plane) {
    if (!planar_) planar_ = std::make_unique<PlanarDynamics>(mechanism_.data(), settings_);
    if (!planar_->evaluate(at.t, at.y, at.angles, ydot_)) return false;
    planar_->write_motion(motion_);
  } else {
    if (!spatial_) spatial_ = std::make_unique<SpatialDynamics>(mechanism_, settings_);
    if (!spatial_->evaluate(at.t, at.y, at.angles, ydot_)) return false;
    motion_.z = spatial_->z();
    motion_.lambda = spatial_->lambda();
  }
  return true;
}

Motion& MotionSolver::bar(MotionPart part) {
  if (part == MotionPart::all) part_of_bar_ = part;
  return bar_;
}

void MotionSolver::fold_bar(const StatePoint& at, Eigen::Ref<Eigen::VectorXd> y_bar,
                            Eigen::Ref<Eigen::VectorXd> rho_bar) {
  motion(at, part_of_bar_);
  y_bar_.setZero();
  theta_bar_.setZero();
  rho_bar_.setZero();
  const auto fold = [&](auto& dynamics) {
    if (!linearised_) dynamics.linearise_here();
    linearised_ = true;
    dynamics.add_adjoint(w_, y_bar_, theta_bar_, rho_bar_, &bar_);
  };
  *solved_ == MotionPart::in_plane ? fold(*planar_) : fold(*spatial_);
  y_bar += y_bar_;
  rho_bar += rho_bar_;
  mechanism_.data().add_to_rho(theta_bar_, rho_bar);
  for (Vec<6>& z : bar_.z) z.setZero();
  bar_.lambda.setZero();
  part_of_bar_ = MotionPart::in_plane;
}

}  // namespace mbsopt
