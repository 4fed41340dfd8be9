// A scene simulated at given parameters, with its rows for trajectory.csv and the values of objectives. The files of a
// motion.
#pragma once

#include "app/results/recorded_motion.hpp"
#include "app/run/run.hpp"

namespace mbsopt::inline app {

struct SimulatedMotion : RecordedMotion {  // up to the last good time where the simulation failed
  SimulationResult simulation;
  Eigen::VectorXd psi;                             // per objective of the problem, where the simulation is ok
  std::vector<std::optional<double>> true_values;  // of smooth maxima and minima among them
  ModelSummary model;                              // set if the assembly is ok
  std::vector<std::string> warnings;               // of the start
  std::vector<std::vector<double>> instants = {};  // per objective, of its tracked points without prescribed timing [s]
  Trajectory running = {};  // t, then per objective what it integrates or takes the mean or extreme of; NaN: nothing
};

// Draws the progress of `run`, and stops if the user interrupts.
SimulatedMotion simulated_motion(Run& run, const Eigen::VectorXd& rho);

// Adds the instants of tracked points to the objectives in the result.
void add_instants(Run& run, const SimulatedMotion& motion);

// Writes trajectory.csv into the folder of the run, with --mat also trajectory.mat. Warns of each column with empty
// cells. Ctrl-C stops the run without the files.
void write_trajectory(Run& run, const Trajectory& trajectory, const std::vector<SingularPosition>& singular);

// Throws std::invalid_argument if the scene has no sensors or no parameters.
void require_sensitivities(const Scene& scene);

// sensitivities.csv: the tangent-linear model of the trajectory as a table, with a row per output time. Columns are t,
// then per sensor and parameter  d SENSOR/d PARAMETER. These are total derivatives, with the dependence of the start.
// A failed or stopped run leaves no file; the outcome of `run` gives the reason.
void write_sensitivities(Run& run);

}  // namespace mbsopt::inline app
