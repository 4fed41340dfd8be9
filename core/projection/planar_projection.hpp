// The projection of projection.hpp in the plane, where a position is (r, theta), P = e^(i theta/2), and both levels are
// conditions on three numbers per body:
//
//   positions:   r = r^ + delta_r,  theta = theta~ + 2 atan(delta_theta/2):    M delta + J(q~)' nu = 0,   Phi(q) = 0
//   velocities:  (rdot, w) = (rdot^, w_n) + u,  w_n = 2 Im(conj(P) Pdot^):     M u + J(q)' kappa = 0,  Phidot = 0
//
// The same numbers as in space: pi = p~ + 1/2 G(p~)' delta_theta normalised is a turn by 2 atan(delta_theta/2).
#pragma once

#include <vector>

#include "core/dynamics/planar_bodies.hpp"
#include "core/dynamics/saddle_solver.hpp"
#include "core/projection/projection_iterations.hpp"

namespace mbsopt {

class PlanarProjector {
 public:
  explicit PlanarProjector(const MechanismData& data);

  // As those of Projector, of positions and velocities.
  bool project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
               ProjectionSolution& solution);
  bool linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, const Eigen::VectorXd& y,
                 const ProjectionSolution& solution);
  void tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir);
  void add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar);
  void response(Eigen::VectorXd& out);
  double position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y);
  double velocity_violation(double t, const Eigen::VectorXd& y);
  long factorisations() const { return solver_.factorisations(); }

 private:
  struct Body {
    Plane P_hat, Pdot_hat, P_tilde, P, r_hat, r;
    double turn_by_delta = 1;  // d theta/d delta_theta
    Plane rdot;
    double w_n = 0, w = 0;
  };

  void set_hat(const Eigen::VectorXd& y_hat);
  void set_positions();   // of delta_
  void set_velocities();  // of u_
  void read(const Eigen::VectorXd& y);
  // Multiplies turns by d theta/d delta_theta.
  template <class X>
  void turn_by_E(std::vector<X>& x) const;
  // b = -M' x - (J'nu)' in the directions of the parameters, load_dirs_ holding (J'nu)'.
  void set_b(const ParameterBlock& block, const std::vector<Vec<3>>& x);
  void add_mass_bar(const std::vector<Vec<3>>& eta, const std::vector<Vec<3>>& x, Eigen::VectorXd& theta_bar) const;

  const MechanismData& data_;
  const PlanarModel& model_;
  const PlanarBodies bodies_in_y_;
  PlanarSaddleSolver solver_;  // factor of S(q~)
  PlanarRows rows_;            // J at the projected q
  PlanarConstraints constraints_;
  RowLaws laws_;
  Eigen::VectorXd angles_;

  std::vector<Body> bodies_;
  PlanarConstraints::Frames frames_, frames_tilde_;
  std::vector<Vec<3>> delta_, u_, b_, x_;
  Eigen::VectorXd nu_, kappa_, phi_, g_, mu_;
  Corrections<Vec<3>, Eigen::VectorXd> corrections_;
  std::vector<PlanarShift> shifts_, still_;
  std::vector<PlanarFrameBar> bars_;
  struct PositionBar {
    Plane r;
    double theta = 0;
  };
  std::vector<PositionBar> q_bar_, v_bar_;
  // Lanes.
  PlanarConstraints::DualFrames dual_frames_;
  std::vector<Lanes<3>> q_dir_, v_dir_, load_dirs_, b_lanes_, x_lanes_;
  ConstraintTangents dirs_;
  LaneRows g_lanes_, nu_lanes_;
  Corrections<Lanes<3>, LaneRows> corrections_of_lanes_;
};

}  // namespace mbsopt
