// Signs in an accepted step that make a run's numbers worthless although all of them are finite. The run asks after
// each step. An objection ends the run, in words:
//   - the law of a drive jumps, or its rate does (law_jumps.hpp)
//   - the energy of a mechanism on which nothing does work has grown by half of all it has
//   - the accelerations of the constraints were not met
//   - a body is faster than any real one
//   - a bushing has reached half a turn, where its torque jumps (bushing.hpp)
// It also notes the energy and how far the state is from the constraints.
#pragma once

#include <string>

#include "core/mechanism/mechanism_data.hpp"
#include "core/projection/projection.hpp"
#include "core/scene/settings.hpp"
#include "core/start/law_jumps.hpp"
#include "core/watch/step_observer.hpp"

namespace mbsopt {

class RunGuard final : public StepObserver {
 public:
  // Each half turn of a body takes at least one of the steps of the settings. The projector only measures violations.
  // Without `objects` there are no objections: given steps have been judged where they were found.
  RunGuard(const MechanismData& data, Projector& projector, const SimulationSettings& settings,
           SimulationStatistics& statistics, bool objects = true);

  std::string begin(const StatePoint& start) override;
  std::string look_at(const SeenStep& step) override;

 private:
  std::string about_turns(const StatePoint& start) const;
  std::string about_energy(double t, const Energy& energy);
  std::string about_speed(double t, const Eigen::VectorXd& y) const;

  const MechanismData& data_;
  Projector& projector_;
  const SimulationSettings& settings_;
  SimulationStatistics& statistics_;
  const bool objects_, conserves_energy_;
  LawJumps law_jumps_;
  double last_t_ = 0, before_t_ = 0;
  double energy_largest_ = 0, energy_natural_ = 0;  // natural: of weights and springs [J]
  Eigen::Vector2d bounds_;                          // of the speed of a centre of mass [m/s] and of turning [rad/s]
};

}  // namespace mbsopt
