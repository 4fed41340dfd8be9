// What an accepted step may show that makes a run's numbers worthless although all of them are finite. Asked after each
// step; an objection ends the run, in words.
//   - the law of a drive jumps, or its rate does (law_jumps.hpp)
//   - the energy of a mechanism on which nothing does work has grown by half of all it has
//   - the accelerations of the constraints were not met
#pragma once

#include <string>

#include "core/integrate/law_jumps.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class RunGuard {
 public:
  explicit RunGuard(const MechanismData& data);

  void begin(double t, const Eigen::VectorXd& y, const Energy& energy);
  // After a step: its end, the energy there, and the largest relative residual of the constraints' accelerations so
  // far. Empty: none.
  std::string objection(double t, const Energy& energy, double acceleration_residual);

 private:
  std::string about_energy(double t, const Energy& energy);

  const MechanismData& data_;
  bool conserves_energy_;
  LawJumps law_jumps_;
  double last_t_ = 0;
  double energy_initial_ = 0, energy_largest_ = 0, energy_natural_ = 0;  // natural: of weights and springs [J]
};

}  // namespace mbsopt
