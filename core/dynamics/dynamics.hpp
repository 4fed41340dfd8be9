// The equations of motion, solved for the accelerations, with their tangent and adjoint, in space or in the plane.
//
//   M z + J'lambda = f(t, q, v)           M = diag(m I, inertia);   f: gravity, springs, -omega x inertia omega
//   gamma(q, v) = Phiddot at z = 0  + 2 xi omega Phidot + omega^2 Phi
//   augmented Lagrangian:  J z + gamma = 0        penalty:  lambda = alpha (J z + gamma)
//
// The derivatives are those of the constrained equations, which are the limit of the augmented-Lagrangian iteration.
//
//   Dynamics dynamics(mechanism, settings);
//   dynamics.evaluate(t, y, angles, ydot);
//
// Each thread needs its own Dynamics: it owns every array that a right-hand side uses.
#pragma once

#include <memory>

#include "core/dynamics/spatial_dynamics.hpp"

namespace mbsopt {

class PlanarDynamics;

class Dynamics {
 public:
  // The mechanism must have a planar model for `planar`.
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
  SpatialDynamics& in_space() { return *spatial_; }  // only if it is not planar
  long factor_blocks() const;
  long factorisations() const;
  long linearised_states() const { return linearised_states_; }
  // Returns the largest residual of J z + gamma over all evaluations: relative to z, or to usual accelerations at the
  // state. It is 0 for penalty.
  double worst_residual() const { return worst_residual_; }
  void set_worst_residual(double residual) { worst_residual_ = residual; }  // states that were tried do not count

 private:
  const Mechanism mechanism_;  // keeps the data alive
  const bool constrained_;     // augmented Lagrangian
  // One of the two is null.
  std::unique_ptr<SpatialDynamics> spatial_;
  std::unique_ptr<PlanarDynamics> planar_;
  double worst_residual_ = 0;
  long linearised_states_ = 0;
};

}  // namespace mbsopt
