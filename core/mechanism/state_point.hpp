// The state at one instant, for costs, sensors and observers.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

using VecIn = Eigen::Ref<const Eigen::VectorXd>;
using VecOut = Eigen::Ref<Eigen::VectorXd>;

// The solution of the equations of motion at a state, or a gradient in it.
struct Motion {
  std::vector<Vec<6>> z;   // per body (rddot, omegadot), omegadot in body axes
  Eigen::VectorXd lambda;  // per row of Phi
};

struct StatePoint;

// What a sensor reads of the motion. If the mechanism moves in a plane, accelerations and the loads within the plane
// follow from the equations of the plane alone. Multipliers of other rows are then 0.
enum class MotionPart { in_plane, all };

// Sensors of accelerations and reactions get the motion from this source (core/dynamics/motion_solver.hpp).
struct MotionSource {
  virtual ~MotionSource() = default;
  virtual const Motion& motion(const StatePoint& at, MotionPart part) = 0;
  // A gradient in the motion: zero, until a sensor adds to it in the part that it reads.
  virtual Motion& bar(MotionPart part) = 0;
  // Turns this gradient into one in the state and the parameters, adds it to them, and sets it to zero.
  virtual void fold_bar(const StatePoint& at, Eigen::Ref<Eigen::VectorXd> y_bar,
                        Eigen::Ref<Eigen::VectorXd> rho_bar) = 0;
};

struct StatePoint {
  double t;                  // [s]
  const Eigen::VectorXd& y;  // (q, v): q has 7 numbers per body (r_g, p), v = qdot
  const Eigen::VectorXd&
      angles;  // per tracked joint: an angle on the branch in use; size 0 where none is tracked [rad]
  MotionSource* motion = nullptr;         // needed by sensors of accelerations and reactions only
  const Eigen::VectorXd* ydot = nullptr;  // dy/dt of the dense output; for observers of runs with tangents only
};

}  // namespace mbsopt
