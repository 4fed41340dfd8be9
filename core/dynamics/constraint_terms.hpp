// Computes values and derivatives of all constraints of a mechanism. Frames give the bodies, the ground first; laws
// give the time (call set_time before); angles give the branches of followed joint angles.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/mechanism/row_laws.hpp"

namespace mbsopt {

// Weights of the scalar  lambda'J eta + mu0'Phi + mu1'Phidot + mu2'Phiddot  (null: zero); eta is in the frames.
struct ConstraintWeights {
  const Eigen::VectorXd* lambda = nullptr;
  const Eigen::VectorXd* mu0 = nullptr;
  const Eigen::VectorXd* mu1 = nullptr;
  const Eigen::VectorXd* mu2 = nullptr;
};

// Tangents of Phi, Phidot, Phiddot.
struct ConstraintTangents {
  LaneRows phi, phi_dot, phi_ddot;
};

class ConstraintTerms {
 public:
  explicit ConstraintTerms(const MechanismData& data) : data_(&data) {}

  using Frames = std::vector<Frame>;

  void phi(const Frames& frames, const RowLaws& laws, const Eigen::VectorXd& angles, Eigen::VectorXd& out) const;
  void phi_dot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const;
  void phi_ddot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const;

  // Adds scale times the gradient of the weighted scalar: in the frames to bars, in the geometry to theta_bar, through
  // laws to rho_bar.
  void add_pull_back(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                     const ConstraintWeights& weights, double scale, std::vector<FrameBar>& bars,
                     Eigen::Ref<Eigen::VectorXd> theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) const;

  // Sets the tangents in the directions of bodies and fields. Adds that of J'lambda to loads, one per body, the
  // ground's first.
  void tangents(const Frames& frames, const std::vector<FrameTangent>& directions, RowLaws& laws,
                const Eigen::VectorXd& angles, const ParameterBlock& block, const Eigen::VectorXd& lambda,
                ConstraintTangents& out, std::vector<Lanes<6>>& loads) const;
  // Does the same for bodies at rest: it visits only constraints and laws with such fields.
  void field_tangents(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles, const ParameterBlock& block,
                      const Eigen::VectorXd& lambda, ConstraintTangents& out, std::vector<Lanes<6>>& loads) const;

 private:
  const MechanismData* data_;
};

}  // namespace mbsopt
