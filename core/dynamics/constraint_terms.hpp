// Values and derivatives of all constraints of a mechanism at given frames (frames[0] is the ground) and one time. Call
// set_time of the laws first. Angles are on the branches of followed joint angles.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/mechanism/row_laws.hpp"

namespace mbsopt {

// Weights of the scalar  lambda'J eta + mu0'Phi + mu1'Phidot + mu2'Phiddot; null weights are zero. The frames hold eta.
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

  // Computes the tangents in the directions of the bodies and of the fields. Adds that of J'lambda to loads, one per
  // body after the ground's. If directions is null, bodies are at rest, and constraints and laws without such fields
  // are skipped.
  void tangents(const Frames& frames, const std::vector<FrameTangent>* directions, RowLaws& laws,
                const Eigen::VectorXd& angles, const ParameterBlock& block, const Eigen::VectorXd& lambda,
                ConstraintTangents& out, std::vector<Lanes<6>>& loads) const;

 private:
  const MechanismData* data_;
};

}  // namespace mbsopt
