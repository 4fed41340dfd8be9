// Mass-orthogonal projection of a state onto the constraints, after each accepted step, with its tangent and adjoint.
//
//   positions:   q = q^ (+) delta:  r = r^ + delta_r,  p = pi/|pi|,  pi = p~ + 1/2 G(p~)' delta_theta,  p~ = p^/|p^|
//                M delta + J(q~)' nu = 0,   Phi(q) = 0
//   velocities:  v = v_n + T(q) u:  v_n = v^ with pdot's part along p removed,
//                M u + J(q)' kappa = 0,     Phidot(q, v) = 0
//
// Both are iterated to rounding with the one factor of S(q~) (saddle_solver.hpp). Derivatives are those of these
// conditions; their linear systems are solved by the same stationary iteration, transposed in the adjoint, a fixed
// number of times. Mass-orthogonal projection: Eich, "Convergence results for a coordinate projection method", SIAM J.
// Numer. Anal. 30 (1993).
#pragma once

#include <memory>
#include <vector>

#include "core/dynamics/constraint_terms.hpp"
#include "core/dynamics/saddle_solver.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/projection/planar_projection.hpp"
#include "core/projection/projection_iterations.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class Projector {
 public:
  // planar: what is none or position_velocity, and the mechanism has a planar model.
  Projector(const Mechanism& mechanism, Projection what, Model model = Model::spatial);

  bool positions() const { return what_ == Projection::position_velocity; }
  bool active() const { return what_ != Projection::none; }
  ProjectionSolution solution() const;  // of the right sizes

  // y = projected y_hat, at time t; angles: branches of the followed joint angles. False where it does not converge.
  bool project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
               ProjectionSolution& solution);

  // Prepares derivatives at a projection made before (also of another Projector of the same mechanism).
  bool linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, const Eigen::VectorXd& y,
                 const ProjectionSolution& solution);
  void tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir);
  // y_hat_bar += (dy/dy_hat)' y_bar, and the same for the differentiated fields and the parameters in laws
  void add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar);

  // After project(), with its factor: the constraint forces that a fixed load on all bodies calls for, and those that
  // these call for as accelerations of the constraints. In the directions that a singular position is about to set free
  // they grow as 1/d^3, d the distance from it, and change their sign there.
  void response(Eigen::VectorXd& out);

  // Largest violations at y: of Phi and the unit norms, and of their rates.
  double position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y);
  double velocity_violation(double t, const Eigen::VectorXd& y);
  long factorisations() const { return planar_ ? planar_->factorisations() : solver_.factorisations(); }

 private:
  struct Body {
    Vector4d p_hat, p_tilde, pi, p, pdot_hat, pdot;
    double norm_hat = 1, norm_pi = 1;
    Matrix3d E;  // d(virtual rotation at p)/d(delta_theta) = G(p) P G(p~)'/|pi|
  };

  void set_frames(const Eigen::VectorXd& q_of, const Eigen::VectorXd* v_of, std::vector<BodyState>& states,
                  std::vector<Frame>& frames) const;
  void set_q(const std::vector<Vec<6>>& delta, Eigen::VectorXd& y);
  void prepare_bodies(const Eigen::VectorXd& y_hat);
  template <class X>
  void turn_by_E(std::vector<X>& x, bool transposed) const;

  const Mechanism mechanism_;
  const MechanismData& data_;
  Projection what_;
  std::unique_ptr<PlanarProjector> planar_;  // where it is there, it does all the work
  SaddleSolver solver_;                      // factor of S(q~)
  ConstraintRows rows_;                      // J at the projected q
  RowLaws laws_;
  Eigen::VectorXd angles_;
  const ProjectionSolution* solution_ = nullptr;

  std::vector<Body> bodies_;
  std::vector<BodyState> states_, states_tilde_;
  std::vector<Frame> frames_, frames_tilde_;
  Eigen::VectorXd phi_, g_, mu_, scratch_y_;
  std::vector<Vec<6>> b_, x_;
  Corrections<Vec<6>, Eigen::VectorXd> corrections_;
  std::vector<FrameBar> bars_;
  Eigen::VectorXd q_bar_, v_bar_;
  // Lanes.
  std::vector<FrameTangent> frame_dirs_;
  std::vector<Lanes<6>> loads_, b_lanes_, x_lanes_;
  ConstraintTangents dirs_;
  LaneRows g_lanes_, nu_lanes_;
  Corrections<Lanes<6>, LaneRows> corrections_of_lanes_;
};

}  // namespace mbsopt
