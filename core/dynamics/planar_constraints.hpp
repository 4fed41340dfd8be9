// The constraints of a planar model (planar_model.hpp): Phi, its time derivatives, J'lambda and all their derivatives,
// in the three displacements (eta_r, eta_theta) per body.
//
//   point      Phi = r2 + A2 s2 - r1 - A1 s1                  d: the same separation below
//   dot1       Phi = (A1 s1)'(A2 s2)
//   dot2       Phi = (A1 s3)'d
//   distance   Phi = |d|
//   angle      Phi = +-(arg(A2 s2) - arg(A1 s1))
//
// Each is a function of the bodies' frames, as in space (primitive.hpp). Derivatives are taken per body.
#pragma once

#include <vector>

#include "core/body/planar_frame.hpp"
#include "core/dynamics/constraint_terms.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/mechanism/row_laws.hpp"

namespace mbsopt {

// J' of a row: the force and moment of a unit multiplier on each body (factor left out).
template <class T>
struct PlanarColumn {
  Complex<T> force1, force2;
  T moment1 = 0, moment2 = 0;
};
PlanarColumn<double> jacobian_of_row(const PlanarConstraint& c, const PlanarFrame<double>& f1,
                                     const PlanarFrame<double>& f2);

class PlanarConstraints {
 public:
  explicit PlanarConstraints(const MechanismData& data) : model_(data.planar.get()) {}

  enum class Order { phi, phi_dot, phi_ddot };
  using Frames = std::vector<PlanarFrame<double>>;
  using DualFrames = std::vector<PlanarFrame<Dual>>;

  // Rows that every planar motion satisfies stay zero.
  void phi(const Frames& frames, const RowLaws& laws, const Eigen::VectorXd& angles, Eigen::VectorXd& out) const;
  void phi_dot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const;
  void phi_ddot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const;

  // The planar form of ConstraintTerms::add_pull_back.
  void add_pull_back(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                     const ConstraintWeights& weights, double scale, std::vector<PlanarFrameBar>& bars,
                     Eigen::Ref<Eigen::VectorXd> theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) const;

  // Sets the tangent of Phi, Phidot or Phiddot in the directions of the frames and of the vectors. The other two
  // members of out are undefined. Adds the tangent of J'lambda to loads, which begin with the ground's. Points add
  // nothing to Phiddot' here; their tangents are below.
  void tangents(Order order, const DualFrames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                const ParameterBlock& block, const Eigen::VectorXd& lambda, ConstraintTangents& out,
                std::vector<Lanes<3>>& loads) const;

  // The tangent of Phi in the directions of the fields alone, with bodies at rest. It skips constraints and laws
  // without such directions.
  void field_tangents(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles, const ParameterBlock& block,
                      LaneRows& phi) const;

  // Most joints of a plane are points. In the frames, with lambda and the vectors held fixed:
  //   d(J'lambda)_theta of a body = cross(A', W),  W: sum of +-conj(s) lambda over its points      [the ground's first]
  void set_point_moments(const Eigen::VectorXd& lambda, std::vector<Plane>& W) const;
  // c -= Phiddot' in the directions Addot' (rows re, im, the ground's first) and in those of the vectors. Also b -=
  // (J'lambda)' in the directions of the vectors; b has no entry of the ground.
  void subtract_point_tangents(const Frames& frames, const std::vector<Lanes<2>>& Addot_dirs,
                               const ParameterBlock& block, const Eigen::VectorXd& lambda, LaneRows& c,
                               std::vector<Lanes<3>>& b) const;
  // Marks the bodies (the ground first) of all constraints except points.
  void mark_others(std::vector<bool>& bodies) const;

 private:
  template <Order order, class Branch>
  void evaluate(const Frames& frames, Branch&& branch, Eigen::VectorXd& out) const;

  const PlanarModel* model_;
};

}  // namespace mbsopt
