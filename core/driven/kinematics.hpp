// Motion of a fully driven mechanism: positions, velocities, accelerations and the forces of its drives, at given
// times. It is a solved run (driven_run.hpp) whose accelerations follow from the equations of joints and drives alone.
// So bodies may be without mass.
//
//   J z = -gamma,    J'lambda = f - M z        z = (rddot, omegadot) per body, J = Phi_q, least squares
#pragma once

#include <functional>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt {

// start is the mechanism assembled at the first of the times, which ascend. `settings` gives the formulation and the
// largest number of steps (integrator.max_steps). `observe` gets the motion (accelerations, multipliers) in the point.
// `go_on` is called after each step with its time, and ends the run by returning false.
SimulationResult solve_kinematics(const Mechanism& mechanism, const Assembly& start, const SimulationSettings& settings,
                                  const std::vector<double>& times,
                                  const std::function<void(std::size_t, const StatePoint&)>& observe,
                                  const std::function<bool(double)>& go_on = {});

}  // namespace mbsopt
