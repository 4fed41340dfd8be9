// report.html per command: its input, its numbers, its plots. It has no time of day and no seconds of computing, so the
// same inputs give the same bytes; only that of `tradeoff` shows seconds, because it measures them. The numbers come
// from the parts of result.json.
#pragma once

#include <string>
#include <vector>

#include "app/files/result_json.hpp"
#include "app/report/motion_plots.hpp"
#include "app/report/motion_scene.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/trajectory_csv.hpp"
#include "core/start/linearisation.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {

struct SweepPoints;

// The parts of a motion in a report beside its trajectory; each may be empty.
struct MotionParts {
  std::vector<PointTarget> targets = {};
  Trajectory forces = {};                  // of joints (joint_forces.hpp)
  Trajectory efforts = {};                 // t, then the force or torque of each drive by name; of kinematics
  std::vector<PlotInstant> instants = {};  // [s] marked in all plots over time
};
std::string simulation_report(const Scene& scene, const Json& result, const Trajectory& trajectory,
                              const MotionParts& parts = {});

// x has the outputs and inputs of the result. state holds t and the bodies' part of a row of trajectory.csv. shapes
// holds the same, displaced along each mode.
std::string linearisation_report(const Scene& scene, const Json& result, const Linearisation& x,
                                 const std::vector<double>& state, const std::vector<std::vector<double>>& shapes);

std::string gradient_report(const Scene& scene, const Json& result);
std::string check_report(const Scene& scene, const Json& result);

// A motion of a design. running holds t, then per objective its integrand, or the expression of its mean or extreme.
struct DesignMotion {
  const Trajectory& trajectory;
  const Trajectory& forces;
  const Trajectory& running;
};
// The title of the plot of an objective's running term, and its limits.
struct RunningTerm {
  std::string objective, title, y_label;
  std::vector<PlotLimit> limits = {};
};
// rho holds the designed parameters. history holds columns and rows of history.csv (iteration, objective, ...).
std::string design_report(const Scene& scene, const Eigen::VectorXd& rho, const Json& result, const Trajectory& history,
                          const DesignMotion& before, const DesignMotion& after, const SensorLimits& limits = {},
                          const std::vector<RunningTerm>& terms = {}, const std::vector<PointTarget>& targets = {});

// The measurements of one channel of one experiment, and the fitted model at the same times. Values are in SI units.
// NaN separates the windows of an experiment.
struct FitPlot {
  std::string experiment, channel, unit;  // channel: its column without the unit
  std::vector<double> times = {}, measured = {}, model = {},
                      residual = {};                     // residual: weighted, (measured - model)/sigma
  bool validates = false;                                // its experiment is scored, not fitted
  std::vector<double> prediction = {};                   // half of the 95 % interval of a measurement; nan: not known
  std::vector<double> initial_times = {}, initial = {};  // the model before the fit; empty: not known
};
// motion is that of the first fitted experiment.
std::string identification_report(const Scene& scene, const Json& result, const Trajectory& history,
                                  const std::vector<FitPlot>& fits, const std::vector<MovingState>& motion = {});

// The points with the least and largest value of each objective, the best points, and each objective over each varied
// parameter. table has the columns of sweep.csv: the number of the point, its varied parameters, its objectives. A
// missing value is NaN.
std::string sweep_report(const Problem& problem, const SweepPoints& points, const Json& result,
                         const Trajectory& table);

// Work-precision plots, recommendations, the accuracy of the reference.
std::string tradeoff_report(const Json& result, const Tradeoff& tradeoff, const ObjectiveUnits& units);
std::string penalty_report(const Json& result, const PenaltyStudy& study);

}  // namespace mbsopt::inline app
