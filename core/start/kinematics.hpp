// Motion of a fully driven mechanism: positions, velocities, accelerations and the forces of its drives, without
// integration.
//
//   positions      Phi(q, t) = 0 by Newton's method from a predictor of second order, continued in time
//   velocities     Phi_q v = -Phi_t,    accelerations and multipliers from the equations of motion: linear solves
//
// The positions follow one branch (driven_path.hpp). If J loses rank, the position is singular. The path crosses it if
// steps to either side of it are possible. The report gives the lost rank, and the joints and drives whose equations
// depend on each other.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"
#include "core/start/singular_window.hpp"

namespace mbsopt {

struct KinematicsResult {
  bool ok = false;
  std::string message;
  double last_good_time = 0;
  long steps = 0, iterations = 0;
  double max_position_violation = 0, max_velocity_violation = 0;
  std::vector<SingularPosition> singular;  // among the times wanted
};

// start is the mechanism assembled at the first of the times, which ascend. `settings` gives the formulation and the
// largest number of steps (integrator.max_steps). `observe` gets the motion (accelerations, multipliers) in the point.
// `go_on` is called before each step with its time. Either ends the run by returning false.
KinematicsResult solve_kinematics(const Mechanism& mechanism, const Assembly& start, const SimulationSettings& settings,
                                  const std::vector<double>& times,
                                  const std::function<bool(std::size_t, const StatePoint&)>& observe,
                                  const std::function<bool(double)>& go_on = {});

// The singular position of a state, which the motion does not pass smoothly.
SingularPosition singular_position(const Mechanism& mechanism, double t, const Eigen::VectorXd& y);
// The entry of a window among the known ones, to which it is added if it is new.
SingularPosition& singular_position(const Mechanism& mechanism, const SingularWindow& window,
                                    std::vector<SingularPosition>& known);

// The reason why the positions cannot be continued from a state at t, in words: a jump of a law, or the position.
std::string why_stuck(const Mechanism& mechanism, const SimulationSettings& settings, double t,
                      const Eigen::VectorXd& y);

}  // namespace mbsopt
