// The forces of users inside the equations of motion. They turn the 7 coordinates of a body's force Q into its 6 loads
// T'Q, with derivatives. The virtual work is e'Q with e = T(p) eta = (eta_r, 1/2 G(p)' eta_theta).
//
// Mass terms of users are loads on the accelerations z themselves: -M z - h. M joins the bodies' mass in the solver.
//
// Each thread needs its own UserLoads: it owns the numbers of one evaluation. It allocates nothing after construction.
#pragma once

#include <vector>

#include "core/dynamics/force_terms.hpp"
#include "core/dynamics/saddle_solver.hpp"

namespace mbsopt {

class UserLoads {
 public:
  explicit UserLoads(const MechanismData& data);

  // The accelerations z per body without the ground. Derivatives of mass terms are those of -M z - h, loads are -h.
  using Accelerations = std::vector<Vec<6>>;
  void add_loads(const ForceTerms::At& at, std::vector<Vec<6>>& loads);
  // Derivatives of the loads in the state as blocks, and in the directions of the parameters.
  void add_blocks(const ForceTerms::At& at, const Accelerations& z, MotionBlocks& out);
  void add_field_tangent(const ForceTerms::At& at, const Accelerations& z, const ParameterBlock& block,
                         std::vector<Lanes<6>>& load_dirs);
  // Adds the gradient of the virtual work sum load'eta; eta is per body, without the ground.
  void add_pull_back(const ForceTerms::At& at, const Accelerations& z, const std::vector<Vec<6>>& eta,
                     Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& rho_bar);

  // M of each mass term at a state.
  void set_masses(const Eigen::VectorXd& y);
  const std::vector<AddedMass<6>>& masses() const { return masses_; }

 private:
  void set_state(const UserForceData& force, const Eigen::VectorXd& y);
  void evaluate(const UserForceData& force, const ForceTerms::At& at, const Accelerations& z);
  void set_L_rho(const UserForceData& force, const Accelerations& z);

  const MechanismData& data_;
  Eigen::VectorXd q_, v_, Q_, e_;
  Eigen::MatrixXd K_, C_, Q_rho_;
  std::vector<AddedMass<6>> masses_;
  Eigen::VectorXd z_, L_;
  Eigen::MatrixXd M_, L_y_, L_rho_;
};

}  // namespace mbsopt
