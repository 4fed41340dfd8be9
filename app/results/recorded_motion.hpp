// The motion of a run as tables with a row per instant.
//
//   RecordedMotion motion;
//   simulate(mechanism, settings, {}, record_motion(mechanism, scene, motion));
#pragma once

#include "app/results/trajectory_csv.hpp"
#include "core/run/simulation_result.hpp"

namespace mbsopt::inline app {

struct RecordedMotion {
  Trajectory trajectory;  // trajectory.csv
  Trajectory forces;      // t, then per joint its force on the second body in global axes [N]: arrows of a report
  Trajectory efforts;     // t, then the force or torque of each drive, positive if it increases its coordinate
};

// Fills `motion`, which must outlive the sampling, as must the first two arguments. The forces keep one of several
// instants, and the last.
Sampling record_motion(const Mechanism& mechanism, const Scene& scene, RecordedMotion& motion, bool efforts = false);

}  // namespace mbsopt::inline app
