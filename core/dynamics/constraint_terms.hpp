// Values and derivatives of all constraints of a mechanism at given frames (frames[0]: the ground), at one time (laws,
// set_time called) and on the branches of followed joint angles.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/mechanism/row_laws.hpp"

namespace mbsopt {

void evaluate_phi(const MechanismData& data, const std::vector<Frame>& frames, const RowLaws& laws,
                  const Eigen::VectorXd& angles, Eigen::VectorXd& phi);
void evaluate_phi_dot(const MechanismData& data, const std::vector<Frame>& frames, const RowLaws& laws,
                      Eigen::VectorXd& phi_dot);
void evaluate_phi_ddot(const MechanismData& data, const std::vector<Frame>& frames, const RowLaws& laws,
                       Eigen::VectorXd& phi_ddot);

// Weights of the scalar  lambda'J eta + mu0'Phi + mu1'Phidot + mu2'Phiddot  (null: zero); eta is in the frames.
struct ConstraintWeights {
  const Eigen::VectorXd* lambda = nullptr;
  const Eigen::VectorXd* mu0 = nullptr;
  const Eigen::VectorXd* mu1 = nullptr;
  const Eigen::VectorXd* mu2 = nullptr;
};
// Adds its gradient, times scale, in the frames to bars, in the geometry to theta_bar, through laws to rho_bar.
void add_pull_back(const MechanismData& data, const std::vector<Frame>& frames, RowLaws& laws,
                   const Eigen::VectorXd& angles, const ConstraintWeights& weights, double scale,
                   std::vector<FrameBar>& bars, Eigen::Ref<Eigen::VectorXd> theta_bar,
                   Eigen::Ref<Eigen::VectorXd> rho_bar);

// Tangents of Phi, Phidot, Phiddot, and of J'lambda (added to loads, one per body, the ground's first).
struct ConstraintTangents {
  LaneRows phi, phi_dot, phi_ddot;
};
// In the bodies' directions and those of the fields.
void evaluate_tangents(const MechanismData& data, const std::vector<Frame>& frames, RowLaws& laws,
                       const Eigen::VectorXd& angles, const std::vector<FrameTangent>& directions,
                       const ParameterBlock& block, const Eigen::VectorXd& lambda, ConstraintTangents& out,
                       std::vector<Lanes<6>>& loads);
// In the directions of the fields alone, bodies at rest: only constraints and laws that have some.
void evaluate_field_tangents(const MechanismData& data, const std::vector<Frame>& frames, RowLaws& laws,
                             const Eigen::VectorXd& angles, const ParameterBlock& block, const Eigen::VectorXd& lambda,
                             ConstraintTangents& out, std::vector<Lanes<6>>& loads);

}  // namespace mbsopt
