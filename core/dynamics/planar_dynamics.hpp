// The equations of motion of a planar model (planar_model.hpp), their tangent and adjoint. They are the equations and
// derivatives of dynamics.hpp, in z = (rddot along t1 and t2, omegadot about n) per body,
//
//   pddot:  Pddot = (i omegadot/2 - |Pdot|^2) P
//
// without the gyroscopic term. Springs act in the plane if their points lie in one plane. Other forces, and derivatives
// of springs and torques in the fields, are evaluated in space and reduced to the plane. Those of springs and torques
// in the state are taken in the plane. Only the first tangent allocates after construction.
#pragma once

#include <optional>
#include <vector>

#include "core/dynamics/force_terms.hpp"
#include "core/dynamics/planar_bodies.hpp"
#include "core/dynamics/planar_springs.hpp"
#include "core/dynamics/planar_torques.hpp"
#include "core/dynamics/saddle_settings.hpp"
#include "core/dynamics/user_loads.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class PlanarDynamics {
 public:
  PlanarDynamics(const MechanismData& data, const FormulationSettings& settings);

  // These are documented in spatial_dynamics.hpp.
  bool evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles, Eigen::Ref<Eigen::VectorXd> ydot);
  bool linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                 const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  void acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir, Eigen::Ref<LaneRows> a_dir);
  void linearise_here();
  void add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar, const Motion* motion = nullptr);

  void write_motion(Motion& out) const;  // after evaluate()
  const Eigen::VectorXd& lambda() const { return lambda_of_phi_; }
  double usual_acceleration(double enough) const;
  const PlanarSaddleSolver& solver() const { return solver_; }

 private:
  struct Body {
    Plane P, Pdot;
    double omegadot = 0;
  };
  void set_state(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void place_in_space();
  void set_loads();
  void set_acceleration(std::size_t body, const Vec<3>& z);
  // The vector that M multiplies: z - gravity.
  Vec<3> z_against_gravity(std::size_t body) const {
    return z_[body - 1] - Vec<3>(model_.gravity.re, model_.gravity.im, 0);
  }
  void prepare_tangents();  // the common part of all directions, after linearise()
  void prepare_force_tangents();
  void add_torque_blocks();
  void add_spring_blocks();
  void add_force_tangent(const ParameterBlock& block, const LaneRows& y_dir);
  void add_other_tangents(const ParameterBlock& block, const LaneRows& y_dir);
  void add_force_adjoint(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar);
  ForceTerms::At here() const { return {t_, y_, angles_, frames_in_space_}; }

  const MechanismData& data_;
  const PlanarModel& model_;
  const PlanarBodies bodies_in_y_;
  FormulationSettings formulation_;
  SaddleSettings settings_;
  RowLaws laws_;
  PlanarConstraints constraints_;
  const std::vector<std::size_t> bodies_with_slots_;  // of mass or inertia
  PlanarSaddleSolver solver_;

  double t_ = 0;
  Eigen::VectorXd y_, angles_;
  std::vector<Body> bodies_;
  PlanarConstraints::Frames frames_;
  std::vector<Vec<3>> loads_, z_, eta_;
  Eigen::VectorXd gamma_, phi_, phi_dot_, lambda_, mu_, g_;  // of the rows in the plane
  Eigen::VectorXd lambda_of_phi_;  // of all rows; 0 for rows that every planar motion satisfies

  PlanarSprings springs_;
  bool springs_in_plane_ = false;  // at this state
  PlanarTorques torques_;
  const bool only_torques_;  // in the plane; no other force but springs depends on the state
  // The forces, and the bodies in space that they read and load.
  bool has_springs_, has_other_forces_;
  bool in_space_ = false;  // whether the bodies are placed there at this state
  ForceTerms forces_;
  UserLoads user_;
  const UserLoads::Accelerations no_mass_terms_;
  std::vector<Vec<6>> eta_in_space_;
  std::vector<std::size_t> loaded_;
  std::vector<Frame> frames_in_space_;
  std::vector<Vec<6>> body_loads_;

  struct TurnTangent {
    Mat<2, 4> Addot, Pddot;  // in the directions (Re P, Im P, Re Pdot, Im Pdot)
    Plane moment;            // b_theta' = moment x P', of J'lambda
  };
  struct ForceLinearisation {
    MotionBlocks blocks;
    std::vector<UnitTangents> units;
    struct Block {
      Mat<3, 4> q = Mat<3, 4>::Zero(), v = Mat<3, 4>::Zero();  // by (r, P) and (rdot, Pdot)
      Vec<3> height = Vec<3>::Zero();                          // by r along n, which parameters may change
      bool filled = false;
    };
    std::vector<Block> in_plane;
  };
  bool tangents_ready_ = false;
  std::vector<TurnTangent> turns_;
  std::vector<Plane> moments_;
  std::vector<Lanes<4>> turn_dirs_;  // (P', Pdot')
  std::vector<Lanes<2>> Addot_dirs_;
  std::vector<std::size_t> dual_bodies_;  // of constraints that are no points
  std::optional<ForceLinearisation> force_linearisation_;
  PlanarConstraints::DualFrames dual_frames_;
  ConstraintTangents constraint_dirs_;
  LaneRows gamma_dir_, lambda_dir_;
  std::vector<Lanes<3>> load_dirs_, rhs_lanes_, z_dir_;
  std::vector<Lanes<6>> body_load_dirs_;
  std::vector<PlanarFrameBar> bars_;
  std::vector<FrameBar> bars_in_space_;
};

}  // namespace mbsopt
