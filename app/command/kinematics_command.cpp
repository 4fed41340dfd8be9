#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "app/report/run_page.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/simulated_motion.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/driven/kinematics.hpp"
#include "core/scene/kinematic_scene.hpp"

namespace mbsopt::inline app {
namespace {

Scene prescribed(const Scene& scene) {
  std::vector<SceneIssue> issues;
  Scene out = kinematic_scene(scene, issues);
  if (issues.empty()) return out;
  std::string all;
  for (const SceneIssue& issue : issues) all += (all.empty() ? "" : "\n") + issue.path + ": " + issue.message;
  throw std::invalid_argument(all);
}

// The rows up to the first one with an effort that is no number, unless it has no limit at a singular position.
std::size_t finite_rows(const Trajectory& efforts, const std::vector<SingularPosition>& singular) {
  const auto is_finite = [&](const std::vector<double>& row) {
    const bool nan_has_cause =
        std::ranges::any_of(singular, [&](const SingularPosition& s) { return std::abs(row[0] - s.t) < s.half; });
    return std::ranges::all_of(row, [&](double x) { return std::isfinite(x) || (std::isnan(x) && nan_has_cause); });
  };
  return static_cast<std::size_t>(std::ranges::find_if_not(efforts.rows, is_finite) - efforts.rows.begin());
}

void add_drives(Run& run, const Scene& scene, const Trajectory& efforts) {
  for (std::size_t k = 0; k < scene.drives.size(); ++k) {
    double least = INFINITY, largest = -INFINITY;
    for (const std::vector<double>& row : efforts.rows) {
      least = std::min(least, row[1 + k]);
      largest = std::max(largest, row[1 + k]);
    }
    if (largest < least) continue;  // no number at all
    run.result["drives"][scene.drives[k].name] = {
        {"force_min", least}, {"force_max", largest}, {"unit", unit_of_effort(scene.drives[k])}};
  }
  if (run.result.contains("drives"))
    run.context.out << "\nforce or torque of each drive along its coordinate\n"
                    << table_of(run.result["drives"],
                                {{"drive"}, {"least", "force_min", 6}, {"largest", "force_max", 6}, {"unit", "unit"}})
                           .text();
}

}  // namespace

int kinematics_command(const CommandContext& context) {
  Run run(context);
  const Scene scene = prescribed(run.problem.scene);
  run.start();
  const auto start = std::chrono::steady_clock::now();
  const Mechanism mechanism(scene, parameter_values(scene), std::vector<bool>(scene.parameters.size(), false));
  const Assembly assembly(mechanism, scene.simulation.start_time);
  if (!assembled(run, mechanism, assembly, false)) return run.finish();

  RecordedMotion motion;
  const Sampling sampling = record_motion(mechanism, scene, motion, true);
  const SimulationSettings& settings = scene.simulation;
  SimulationResult kinematics =
      solve_kinematics(mechanism, assembly, settings, sampling.times, sampling.observe, run.watched("kinematics"));
  run.progress.finish();
  SimulationStatistics& statistics = kinematics.statistics;
  const std::size_t finite = finite_rows(motion.efforts, statistics.singular);
  const bool are_finite = finite == motion.efforts.rows.size();
  const double last_good_time = are_finite ? kinematics.last_good_time : motion.efforts.rows[finite].front();
  motion.efforts.rows.resize(finite);
  statistics.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.result["simulation"] = to_json(statistics);
  context.out << fmt::format(
      "{:.6g} s to {:.6g} s in {} positions by {} steps; largest violation {:.1e} (positions), "
      "{:.1e} (velocities)\n",
      settings.start_time, last_good_time, motion.trajectory.rows.size(), statistics.steps,
      statistics.max_position_violation, statistics.max_velocity_violation);
  const bool motion_ends_early = interrupted();
  write_trajectory(run, motion.trajectory, statistics.singular);
  if (!scene.drives.empty()) run.write("drives.csv", to_csv(motion.efforts));
  add_drives(run, scene, motion.efforts);
  if (const std::string words = in_words(statistics.singular, {}); !words.empty()) run.warn(words);
  std::vector<PlotInstant> singular;
  for (const SingularPosition& s : statistics.singular) singular.push_back({"singular", s.t});
  if (motion_ends_early) {
    run.stopped(fmt::format("trajectory.csv holds the motion up to {:.6g} s", last_good_time));
  } else if (!are_finite) {
    run.failed(fmt::format("the forces of the drives are too large for numbers at t = {:.6g} s. Look at masses, "
                           "inertias, coordinates and the forces on the bodies",
                           last_good_time),
               last_good_time);
  } else if (!kinematics.ok()) {
    run.failed(kinematics.message, last_good_time);
  }
  RunPage page(run);
  add_simulated_motion(page, scene, motion, prescribed_points(run.problem), singular);
  page.write();
  return run.finish();
}

}  // namespace mbsopt::inline app
