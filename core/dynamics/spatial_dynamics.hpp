// The equations of motion in space, solved for the accelerations, with their tangent and adjoint (dynamics.hpp).
//
// Unknowns per body: z = (rddot, omegadot), omegadot in body axes. a = qddot = (rddot, pddot) follows from z
// (frame.hpp).
//
//   tangent:  [M J'; J -1/alpha] (z', lambda') = (b', c')                 b, c: motion_terms.hpp
//   adjoint:  [M J'; J -1/alpha] (eta, mu) = (T'w, 0),  then  y_bar += d/dy [ w'a + eta'b + mu'c ]
//
// 1/alpha is 0 if the equations are constrained. T = da/dz.
//
// The adjoint is matrix-free. Tangents multiply with blocks that are evaluated once per state (motion_blocks.hpp).
//
// Each thread needs its own SpatialDynamics: it owns every array that a right-hand side uses. Only the first tangent
// allocates after construction.
#pragma once

#include <vector>

#include "core/dynamics/motion_terms.hpp"
#include "core/dynamics/saddle_settings.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"

namespace mbsopt {

class SpatialDynamics {
 public:
  SpatialDynamics(const Mechanism& mechanism, const FormulationSettings& settings);

  // Computes ydot = (v, a) at (t, y). angles holds the branch of each joint angle. Returns false if S is not positive
  // definite or a number is not finite. z(), lambda(), loads() (f) and gamma() then hold the solution.
  bool evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles, Eigen::Ref<Eigen::VectorXd> ydot);
  const std::vector<Vec<6>>& z() const { return terms_.z; }
  const Eigen::VectorXd& lambda() const { return terms_.lambda; }
  const std::vector<Vec<6>>& loads() const { return terms_.f; }
  const Eigen::VectorXd& gamma() const { return gamma_; }

  // Prepares derivatives at a state whose solution (a = qddot, lambda) is known.
  bool linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                 const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  // Does the same right after evaluate() at this state, with its factor.
  void linearise_here() { terms_.set_accelerations(); }

  // y_dir is the tangent of y (14n x lanes), ydot_dir that of (v, a). z_tangent() returns that of z.
  void tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& ydot_dir);
  void acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir, Eigen::Ref<LaneRows> a_dir);
  const std::vector<Lanes<6>>& z_tangent() const { return z_dir_; }
  // Adds to the cotangents of y, of the differentiated fields, and of the parameters in laws. `w` is the cotangent of
  // (v, a), motion one of z and lambda themselves.
  void add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar, const Motion* motion = nullptr);

  const MechanismData& data() const { return data_; }
  MotionTerms& terms() { return terms_; }
  SaddleSolver& solver() { return solver_; }
  double compliance() const { return settings_.compliance; }
  double usual_acceleration(double enough) const { return terms_.usual_acceleration(enough); }

 private:
  const Mechanism mechanism_;  // keeps the data alive
  const MechanismData& data_;
  const SaddleSettings settings_;
  MotionTerms terms_;
  SaddleSolver solver_;
  std::vector<Vec<6>> loads_bar_, eta_;
  Eigen::VectorXd gamma_, mu_, g_;
  std::vector<Vector4d> pddot_bar_;
  std::vector<Lanes<6>> z_dir_;
  LaneRows lambda_dir_;
};

}  // namespace mbsopt
