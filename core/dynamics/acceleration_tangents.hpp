// The derivatives of the accelerations a = qddot, or z, as dense matrices: tangents in many directions, lane by lane.
#pragma once

#include <Eigen/Core>

#include "core/dynamics/spatial_dynamics.hpp"

namespace mbsopt {

// z = (rddot, omegadot) has 6 rows per body, qddot 7.
enum class Accelerations { qddot, z };

// The dynamics must be linearised at a state. Returns a_y times the columns of directions (14n rows), parameters fixed.
Eigen::MatrixXd acceleration_tangents(SpatialDynamics& dynamics, const Eigen::MatrixXd& directions,
                                      Accelerations a = Accelerations::qddot);
// a_rho with the state fixed, a column per parameter; 0 where a parameter is not active.
Eigen::MatrixXd acceleration_of_parameters(SpatialDynamics& dynamics, Accelerations a = Accelerations::qddot);

}  // namespace mbsopt
