// Signs in an accepted step that make a run's numbers worthless although all of them are finite. The run asks after
// each step. An objection ends the run, in words:
//   - the law of a drive jumps, or its rate does (law_jumps.hpp)
//   - the energy of a mechanism on which nothing does work has grown by half of all it has
//   - the accelerations of the constraints were not met
//   - a body is faster than any real one
//   - a bushing has reached half a turn, where its torque jumps (bushing.hpp)
#pragma once

#include <string>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/start/law_jumps.hpp"

namespace mbsopt {

class RunGuard {
 public:
  explicit RunGuard(const MechanismData& data);

  // Call this at the start of a run to t_end in at most max_steps steps. It needs at least one step in each half turn
  // of a body. Returns an objection or an empty string.
  std::string begin(double t, const Eigen::VectorXd& y, const Energy& energy, double t_end, long max_steps);
  // Call this after a step with its end, the state and the energy there, and the largest relative residual of the
  // constraints' accelerations so far. Returns an objection or an empty string.
  std::string objection(double t, const Eigen::VectorXd& y, const Energy& energy, double acceleration_residual);

  // The largest change of the energy relative to the largest energy, if nothing does work; else 0.
  double relative_energy_drift() const;

 private:
  std::string about_energy(double t, const Energy& energy);
  std::string about_speed(double t, const Eigen::VectorXd& y) const;

  const MechanismData& data_;
  bool conserves_energy_;
  LawJumps law_jumps_;
  double last_t_ = 0, before_t_ = 0;
  Eigen::VectorXd last_y_;
  double energy_initial_ = 0, energy_largest_ = 0, energy_natural_ = 0;  // natural: of weights and springs [J]
  double energy_drift_ = 0;
  Eigen::Vector2d bounds_;  // of the speed of a centre of mass [m/s] and of turning [rad/s]
};

}  // namespace mbsopt
