// The tension of a spring (tsda) and the resisting torque of a torsional one (rsda) as a sensor: the law's value
//   f(x, xdot, t, rho),   x = l or the joint's angle
//   f_y = f_x x_y + f_xdot xdot_y          f_rho = the law's own + through the geometry
#pragma once

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

double tension(const MechanismData& data, const TensionSensor& sensor, double t, const Eigen::VectorXd& y,
               const Eigen::VectorXd& angles);
// y_bar, rho_bar += scale d/dy, d/drho; returns the value.
double add_tension_gradient(const MechanismData& data, const TensionSensor& sensor, double t, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& angles, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                            Eigen::Ref<Eigen::VectorXd> rho_bar);

}  // namespace mbsopt
