// The files of a motion in the folder of its run.
#pragma once

#include "app/results/trajectory_csv.hpp"

namespace mbsopt {

// Writes trajectory.csv; with --mat and --gnuplot also trajectory.mat and trajectory.gp. Warns of each column with
// empty cells. Ctrl-C stops the run without the files.
void write_trajectory(Run& run, const Trajectory& trajectory, const std::vector<SingularPosition>& singular);

}  // namespace mbsopt
