// The forces of users inside the equations of motion. They turn the 7 coordinates of a body's force Q into its 6 loads
// T'Q, with derivatives. The virtual work is e'Q with e = T(p) eta = (eta_r, 1/2 G(p)' eta_theta).
//
// Mass terms of users are loads on the accelerations z themselves: -M z - h.
//
// Each thread needs its own UserLoads: it owns the numbers of one evaluation. It allocates nothing after construction.
#pragma once

#include <vector>

#include "core/dynamics/force_terms.hpp"

namespace mbsopt {

class UserLoads {
 public:
  explicit UserLoads(const MechanismData& data);

  using Bodies = std::vector<BodyState>;  // the ground first
  // Accelerations z per body without the ground, for mass terms. Null means z = 0. The other functions take them at z.
  using Accelerations = std::vector<Vec<6>>;
  void add_loads(const ForceTerms::At& at, const Bodies& bodies, const Accelerations* z, std::vector<Vec<6>>& loads);
  // Derivatives of the loads in the state as blocks, and in the directions of the parameters.
  void add_blocks(const ForceTerms::At& at, const Bodies& bodies, const Accelerations& z, MotionBlocks& out);
  void add_field_tangent(const ForceTerms::At& at, const Bodies& bodies, const Accelerations& z,
                         const ParameterBlock& block, std::vector<Lanes<6>>& load_dirs);
  // Adds the gradient of the virtual work sum load'eta; eta is per body, without the ground.
  void add_pull_back(const ForceTerms::At& at, const Bodies& bodies, const Accelerations& z,
                     const std::vector<Vec<6>>& eta, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& rho_bar);

  // M of each mass term at the state.
  struct Inertia {
    const UserForceData* force = nullptr;
    int body = 0;  // 1-based
    Mat<6, 6> M = Mat<6, 6>::Zero();
  };
  void set_inertias(const Eigen::VectorXd& y);
  const std::vector<Inertia>& inertias() const { return inertias_; }

 private:
  void set_state(const UserForceData& force, const Eigen::VectorXd& y);

  const MechanismData& data_;
  Eigen::VectorXd q_, v_, Q_, e_;
  Eigen::MatrixXd K_, C_, Q_rho_;
  std::vector<Inertia> inertias_;
  Eigen::VectorXd z_, L_;
  Eigen::MatrixXd M_, L_q_, L_rho_;
};

}  // namespace mbsopt
