// The equations of motion, solved for the accelerations, with their tangent and adjoint.
//
// Unknowns per body: z = (rddot, omegadot), omegadot in body axes; a = qddot = (rddot, pddot) follows from it
// (frame.hpp).
//
//   M z + J'lambda = f(t, q, v),          M = diag(m I, inertia),  f: gravity, springs, -omega x inertia omega
//   gamma(q, v) = Phiddot at z = 0  + 2 xi omega Phidot + omega^2 Phi
//   augmented Lagrangian:  J z + gamma = 0        penalty:  lambda = alpha (J z + gamma)
//
// Derivatives are those of the limit of the augmented-Lagrangian iteration, i.e. of the constrained equations:
//   tangent:  [M J'; J -c] (z', lambda') = -( (M z + J'lambda - f)', (J z + gamma)' )  with z, lambda held fixed
//   adjoint:  [M J'; J -c] (eta, mu) = (T'w, 0), then
//             y_bar += d/dy [ w'a - eta'(M z + J'lambda - f) - mu'(J z + gamma) ]
// The adjoint is matrix-free; tangents multiply with blocks that are evaluated once per state (motion_blocks.hpp).
//
// One Dynamics per thread: it owns every array a right-hand side touches. It allocates nothing after construction, but
// in the first call of blocks() or tangent().
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/dynamics/constraint_blocks.hpp"
#include "core/dynamics/constraint_terms.hpp"
#include "core/dynamics/force_terms.hpp"
#include "core/dynamics/planar_dynamics.hpp"
#include "core/dynamics/saddle_solver.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/row_laws.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class Dynamics {
 public:
  // planar: for explicit methods only, that is, for evaluate(), linearise(), tangent(), add_adjoint() and lambda()
  // alone, without a motion's cotangent; the mechanism has a planar model.
  Dynamics(const Mechanism& mechanism, const FormulationSettings& settings, Model model = Model::spatial);

  const MechanismData& data() const { return data_; }
  const FormulationSettings& settings() const { return settings_; }

  // ydot = (v, a) at (t, y); angles: the branch of each joint angle. False where S is not positive definite or a number
  // is not finite. The solution stays available as z() and lambda().
  bool evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles, Eigen::Ref<Eigen::VectorXd> ydot);
  const std::vector<Vec<6>>& z() const { return z_; }
  const Eigen::VectorXd& lambda() const { return planar_ ? planar_->lambda() : lambda_; }
  // Of the same evaluation: f, and gamma.
  const std::vector<Vec<6>>& loads() const { return loads_; }
  const Eigen::VectorXd& gamma() const { return gamma_; }

  // Prepares derivatives at a state whose solution (a = qddot, lambda) is known: frames with accelerations, and the
  // factor of S.
  bool linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                 const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  // The same right after evaluate() at this state, whose factor is still there.
  void linearise_here();

  // The same equations as an implicit method solves them, together with its stages: 7 n + m rows r = 0 for the unknowns
  // (a = qddot, lambda), body by body and then the constraints (equations.cpp):
  //   f - M z - J'lambda,   p'(pddot(z) - a_p)      z = (rddot, omegadot) of a,  pddot(z) as above   [7 per body]
  //   lambda/alpha [penalty] - (J z + gamma)                                                         [m]
  Eigen::Index equations() const { return 7 * data_.n + data_.m; }
  void place_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  void residual(Eigen::Ref<Eigen::VectorXd> r);  // at the place
  // Their derivatives at the place in y and in the parameters, with (a, lambda) fixed:  r_y y' + r_rho, and its
  // transpose.
  void residual_tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& r_dir);
  void add_residual_adjoint(const Eigen::VectorXd& r_bar, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                            Eigen::VectorXd& rho_bar);
  // Pieces of -r_(a, lambda) = [M T, J'; J T, -1/alpha] at the place, T = dz/da: a body's own block with its row of p,
  // a row of J times T, and 1/alpha (0: constrained).
  Mat<7, 7> mass_block(int body) const;
  Mat<1, 7> times_T(int body, const Mat<1, 6>& J_row) const;
  // A fixed a adds omegadot in p to the derivatives with z fixed, and this to a body's own block of -r_q, -r_v, its
  // row of p included.
  Mat<3, 4> omegadot_by_p(int body) const;
  void add_fixed_a(int body, Mat<7, 7>& q, Mat<7, 7>& v) const;
  const ConstraintRows& place_rows() const { return solver_.rows(); }
  double compliance() const;  // 1/alpha of the penalty form, 0: constrained

  // The derivatives of the equations in the state where they were linearised or placed, z and lambda held fixed.
  // Evaluated once there; the first call of all allocates.
  const MotionBlocks& blocks();
  // y_dir: tangent of y (14n x lanes); ydot_dir: of (v, a).
  void tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& ydot_dir);
  // Its lower half, (qddot)'.
  void acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir, Eigen::Ref<LaneRows> a_dir);
  // w: cotangent of (v, a); adds to the cotangents of y, of the differentiated fields, and of the parameters in laws.
  // motion: a cotangent of z and lambda themselves beside it.
  void add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar, const Motion* motion = nullptr);
  const std::vector<Lanes<6>>& z_tangent() const { return z_dir_; }  // after tangent()

  // Statics: from now on laws of time stand still at their values.
  void hold_laws() { laws_.hold(); }

  SaddleSolver& solver() { return solver_; }
  bool is_planar() const { return planar_ != nullptr; }
  long factor_blocks() const { return planar_ ? planar_->factor_blocks() : solver_.factor_blocks(); }
  long linearised_states() const { return linearised_states_; }
  long factorisations() const { return planar_ ? planar_->factorisations() : solver_.factorisations(); }
  // Largest relative residual of the constraints' accelerations over all evaluations (augmented Lagrangian).
  double worst_residual() const { return worst_residual_; }

 private:
  // The time, and what forces see of the state; and a body's part of the state.
  void set_time_and_angles(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  void set_body(const Eigen::VectorXd& y, int body);
  void set_motion(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                  const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  // The tangents, in directions of the state and parameters, of b = f - M z - J'lambda (rhs_lanes_) and c = -(J z +
  // gamma) (gamma_dir_).
  void right_hand_side_tangent(const ParameterBlock& block, const LaneRows& y_dir);
  // y_bar, ... += gradient of  pddot_bar'pddot - eta'(M z + J'lambda - f) - mu'(J z + gamma)  with z and lambda fixed.
  void pull_back(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar);
  // f: of gravity and turning, body by body, and of forces on all.
  void set_own_load(int body);
  void add_forces();
  template <class Usual>
  void note_residual(double ratio, double size, const Eigen::VectorXd& y, Usual&& usual_acceleration);
  double least_usual_acceleration(const Eigen::VectorXd& y) const;
  double turning_acceleration(const Eigen::VectorXd& y, int body) const;
  double usual_acceleration() const;
  ForceTerms::At here() const { return {t_, y_, angles_, frames_}; }
  void set_user_state(const UserForceData& force);
  void add_user_loads();
  void add_user_blocks(MotionBlocks& out);
  void add_user_field_tangent(const ParameterBlock& block);
  void add_user_adjoint(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& rho_bar);
  SaddleSolver::Settings solver_settings(bool derivative) const;

  const Mechanism mechanism_;  // keeps the data alive
  const MechanismData& data_;
  FormulationSettings settings_;
  RowLaws laws_;
  ConstraintTerms constraints_;
  ForceTerms forces_;
  SaddleSolver solver_;
  std::unique_ptr<PlanarDynamics> planar_;  // where it is there, it does all the work

  double t_ = 0, worst_residual_ = 0;
  unsigned long sweeps_ = 0;  // of usual accelerations
  int fastest_ = 1;           // the body that turned fastest when last looked for
  double free_fall_ = 0;      // what gravity alone gives some body, where there are no forces
  long linearised_states_ = 0;
  bool has_forces_, forces_read_y_;
  Eigen::VectorXd y_, angles_;  // y_: where forces read it
  std::vector<BodyState> bodies_;
  std::vector<Frame> frames_;
  std::vector<Vec<6>> loads_, z_, eta_;  // loads_: f, without the ground
  std::vector<Vec<6>> body_loads_;       // with the ground, for forces to add to
  Eigen::VectorXd gamma_, phi_, phi_dot_, lambda_, mu_, g_;
  Eigen::VectorXd a_;  // of a place: qddot as given
  // Derivatives.
  struct Linearisation {
    MotionBlocks blocks;
    ConstraintBlocks constraints;
    std::vector<UnitTangents> units;
    std::vector<std::size_t> bodies_of_units;  // where something reads them
    bool current = false;
  };
  std::optional<Linearisation> linear_;
  std::vector<Lanes<6>> load_dirs_, rhs_lanes_, z_dir_;
  ConstraintTangents constraint_dirs_;
  LaneRows gamma_dir_, lambda_dir_;
  std::vector<FrameBar> bars_;
  std::vector<Vector4d> pddot_bar_;
  // User forces.
  Eigen::VectorXd user_q_, user_v_, user_Q_, user_e_;
  Eigen::MatrixXd user_K_, user_C_, user_Q_rho_;
};

}  // namespace mbsopt
