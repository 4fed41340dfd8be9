// The reaction of the rows of Phi on body 2 of a joint, and the effort of a drive.
//
//   loads of the constraints on body 2:  [F; T] = -J2'lambda    F global, T about the centre of mass in body axes
//   force    F            torque  about P2 = r2 + A2 s2, global:  A2 T - (A2 s2) x F
//   drive    -lambda of its row: the force or torque along the driven coordinate, positive if it increases it
//
// lambda is the solution of the equations of motion (dynamics.hpp). If constraints are redundant, it is the limit of
// the augmented Lagrangian.
#pragma once

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

struct ReactionSensor final : SensorFunction {
  int joint = -1;  // index in the scene
  bool torque = false;
  int component = 0;  // 0..2, or kNorm
  int body2 = 0;
  Vector3d s2 = Vector3d::Zero();  // the joint's point on body 2, from its centre of mass
  int slot_s2 = -1;
  int drive_row = -1;  // of a drive's effort: its row of Phi

  double evaluate(const MechanismData& data, const StatePoint& at, SensorGradient* to) const override;
  // The same at given lambda; with `to`, lambda_bar gets the gradient in it.
  double evaluate(const MechanismData& data, const Eigen::VectorXd& y, const Eigen::VectorXd& lambda,
                  SensorGradient* to, Eigen::VectorXd* lambda_bar) const;
  bool is_in_plane(const MechanismData& data) const;  // a load within the plane of a planar mechanism
};

}  // namespace mbsopt
