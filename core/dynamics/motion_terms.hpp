// The terms of the equations of motion at one motion (t, q, v, z, lambda), with their derivatives:
//
//   b = f - M z - J'lambda      f: gravity, springs, -omega x inertia omega
//   c = -(J z + gamma)          gamma = Phiddot at z = 0  + 2 xi omega Phidot + omega^2 Phi
//
// z = (rddot, omegadot) per body, omegadot in body axes. SpatialDynamics solves b = 0, c = 0 for z and lambda;
// StageEquations takes them as residuals. Only the first call of blocks() allocates after construction.
#pragma once

#include <optional>
#include <vector>

#include "core/dynamics/constraint_blocks.hpp"
#include "core/dynamics/constraint_terms.hpp"
#include "core/dynamics/user_loads.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/row_laws.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class MotionTerms {
 public:
  MotionTerms(const MechanismData& data, const FormulationSettings& settings);

  // The motion: frames begin with the ground, z and f do not. The solver writes z and lambda.
  std::vector<Frame> frames;
  std::vector<Vec<6>> f, z;
  Eigen::VectorXd lambda;
  // The tangents of b and c after set_tangents().
  std::vector<Lanes<6>> b_dir;
  LaneRows c_dir;

  const MechanismData& data() const { return data_; }

  // Sets the state with z = 0 in the frames, and f. angles: the branch of each joint angle.
  void set_state(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  // Sets a motion whose qddot = a and multipliers are known.
  void set_motion(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                  const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& multipliers);
  // Writes z into the frames.
  void set_accelerations();
  // Computes f at the motion.
  void set_loads();

  // Adds the laws and the stabilisation to phi_ddot, the Phiddot of the frames without laws.
  void complete_gamma(Eigen::VectorXd& phi_ddot);
  // J z + gamma
  void acceleration_errors(Eigen::VectorXd& out);

  // Returns the derivatives of b and c in the state as blocks, with z and lambda fixed.
  const MotionBlocks& blocks();
  // Sets the tangents of b and c in directions of the state (14n x lanes), the fields and the parameters.
  void set_tangents(const ParameterBlock& block, const LaneRows& y_dir);
  // Adds the gradient of  pddot_bar'pddot + eta'b + mu'c  with z and lambda fixed. pddot_bar begins with the ground.
  void add_pull_back(const std::vector<Vec<6>>& eta, const Eigen::VectorXd& mu, const std::vector<Vector4d>& pddot_bar,
                     Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar);

  // The mass terms of users at the state, which are part of M.
  const std::vector<AddedMass<6>>& user_masses() const { return user_.masses(); }

  // For statics: laws of time keep their values from now on.
  void hold_laws() { laws_.hold(); }
  // Returns the largest acceleration by gravity, by the loads of a single body or by its own rotation. It stops at the
  // first that reaches `enough`.
  double usual_acceleration(double enough) const;

 private:
  void set_time(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void set_body(const Eigen::VectorXd& y, std::size_t body);
  void set_own_load(std::size_t body);  // gravity and turning
  void add_forces();
  void add_stabilisation(Eigen::VectorXd& gamma);
  ForceTerms::At here() const { return {t_, y_, angles_, frames}; }

  const MechanismData& data_;
  const double two_xi_omega_, omega2_;
  const bool has_forces_, forces_read_y_;
  RowLaws laws_;
  ConstraintTerms constraints_;
  ForceTerms forces_;
  UserLoads user_;

  double t_ = 0;
  Eigen::VectorXd y_, angles_;      // y_: where forces read it
  std::vector<Vec<6>> body_loads_;  // of forces, with the ground
  Eigen::VectorXd phi_, phi_dot_;   // or their weights
  struct Linearisation {
    MotionBlocks blocks;
    ConstraintBlocks constraints;
    std::vector<UnitTangents> units;
    std::vector<std::size_t> bodies_of_units;  // bodies whose units are read
    bool current = false;
  };
  std::optional<Linearisation> linear_;
  std::vector<Lanes<6>> load_dirs_;
  ConstraintTangents constraint_dirs_;
  std::vector<FrameBar> bars_;
};

}  // namespace mbsopt
