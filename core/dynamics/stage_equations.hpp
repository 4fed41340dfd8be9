// The equations of motion as an implicit method solves them with its stages: 7 n + m rows r = 0 for the unknowns (a =
// qddot, lambda). The bodies come first, then the constraints:
//
//   f - M z - J'lambda,   p'(pddot(z) - a_p)      z = (rddot, omegadot) of a             [7 per body]
//   lambda/alpha [penalty] - (J z + gamma)                                               [m]
//
// omegadot = 2 G(p) a_p/(p'p) is the part of a_p = pddot that turns the body. The other part has its own equation,
// p'a_p + (pdot'pdot)(p'p) = 0. With a fixed,  omegadot' = -2/(p'p) (G(a_p) p' + omegadot (p'p')).
//
//   StageEquations equations(dynamics);
//   equations.place_at(t, y, angles, a, lambda);
//   equations.residual(r);
#pragma once

#include <vector>

#include "core/body/state_layout.hpp"
#include "core/dynamics/spatial_dynamics.hpp"

namespace mbsopt {

class StageEquations {
 public:
  explicit StageEquations(SpatialDynamics& dynamics);  // uses its terms and the rows of its solver

  static Eigen::Index count(const MechanismData& data) { return StateLayout{data.n}.positions() + data.m; }

  // Sets the motion at which all functions below evaluate.
  void place_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda);
  void residual(Eigen::Ref<Eigen::VectorXd> r);
  // Derivatives in y and in the parameters, with (a, lambda) fixed: r_y y' + r_rho rho', and the transpose.
  void tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& r_dir);
  void add_adjoint(const Eigen::VectorXd& r_bar, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar);

  // Pieces of -r_(a, lambda) = [M Z, J'; J Z, -1/alpha] with Z = dz/da: a body's own block with its row of p, and a row
  // of J times Z. 1/alpha is 0 if constrained.
  Mat<7, 7> mass_block(int body) const;
  Mat<1, 7> times_Z(int body, const Mat<1, 6>& J_row) const;
  double compliance() const { return dynamics_.compliance(); }
  const ConstraintRows& rows() const { return dynamics_.solver().rows(); }
  // The derivatives of b and c with z fixed. A fixed a adds terms of omegadot_by_p; add_fixed_a adds them to a body's
  // own block of -r_q and -r_v, with its row of p.
  const MotionBlocks& blocks() { return terms_.blocks(); }
  Mat<3, 4> omegadot_by_p(int body) const;
  void add_fixed_a(int body, Mat<7, 7>& q, Mat<7, 7>& v) const;

  long places() const { return places_; }  // how often place_at() was called

 private:
  Mat<6, 6> mass(int body) const;

  SpatialDynamics& dynamics_;
  MotionTerms& terms_;
  const MechanismData& data_;
  Eigen::VectorXd a_, mu_;
  std::vector<Vec<6>> z_bar_, eta_;
  std::vector<Vector4d> no_pddot_bar_;
  std::vector<Lanes<6>> z_dir_;
  long places_ = 0;
};

}  // namespace mbsopt
