// The equations of motion, solved for the accelerations, with their tangent and adjoint, in space or in the plane.
//
//   M z + J'lambda = f(t, q, v)           M = diag(m I, inertia);   f: gravity, springs, -omega x inertia omega
//   gamma(q, v) = Phiddot at z = 0  + 2 xi omega Phidot + omega^2 Phi
//   augmented Lagrangian:  J z + gamma = 0        penalty:  lambda = alpha (J z + gamma)
//
// Derivatives are those of the limit of the augmented-Lagrangian iteration, i.e. of the constrained equations.
//
//   Dynamics dynamics(mechanism, settings);
//   dynamics.evaluate(t, y, angles, ydot);
//
// One Dynamics per thread: it owns every array that a right-hand side touches.
#pragma once

#include <memory>

#include "core/dynamics/spatial_dynamics.hpp"

namespace mbsopt {

class PlanarDynamics;

class Dynamics {
 public:
  // planar: only where the mechanism has a planar model.
  Dynamics(const Mechanism& mechanism, const FormulationSettings& settings, Model model = Model::spatial);
  ~Dynamics();

  // These are documented in spatial_dynamics.hpp.
  bool evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles, Eigen::Ref<Eigen::VectorXd> ydot);
  const Eigen::VectorXd& lambda() const;
  bool linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                 const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  void acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir, Eigen::Ref<LaneRows> a_dir);
  void add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar);

  bool is_planar() const { return planar_ != nullptr; }
  SpatialDynamics& in_space() { return *spatial_; }  // where it is not planar
  long factor_blocks() const;
  long factorisations() const;
  long linearised_states() const { return linearised_states_; }
  // Returns the largest residual of J z + gamma over all evaluations (augmented Lagrangian; else 0). It is relative to
  // z, or to the accelerations that are usual at the state.
  double worst_residual() const { return worst_residual_; }

 private:
  const Mechanism mechanism_;  // keeps the data alive
  const bool constrained_;     // augmented Lagrangian
  // One of the two.
  std::unique_ptr<SpatialDynamics> spatial_;
  std::unique_ptr<PlanarDynamics> planar_;
  double worst_residual_ = 0;
  long linearised_states_ = 0;
};

}  // namespace mbsopt
