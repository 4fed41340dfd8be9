// The reaction of the rows of Phi on body 2 of a joint, and the effort of a drive.
//
//   loads of the constraints on body 2:  [F; T] = -J2'lambda    F global, T about the centre of mass in body axes
//   force    F            torque  about P2 = r2 + A2 s2, global:  A2 T - (A2 s2) x F
//   drive    -lambda of its row: the force or torque along the driven coordinate, positive where it pushes it up
//
// lambda is the solution of the equations of motion (dynamics.hpp); where constraints are redundant it is the one that
// the augmented Lagrangian tends to.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

double evaluate(const MechanismData& data, const ReactionSensor& sensor, const Eigen::VectorXd& y,
                const Eigen::VectorXd& lambda);
// y_bar, lambda_bar, rho_bar += scale times the gradient.
double add_gradient(const MechanismData& data, const ReactionSensor& sensor, const Eigen::VectorXd& y,
                    const Eigen::VectorXd& lambda, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                    Eigen::VectorXd& lambda_bar, Eigen::Ref<Eigen::VectorXd> rho_bar);

}  // namespace mbsopt
