#include "app/results/write_trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/results/trajectory_gnuplot.hpp"
#include "app/results/trajectory_mat.hpp"
#include "app/terminal/interrupt.hpp"

namespace mbsopt {

void write_trajectory(Run& run, const Trajectory& trajectory, const std::vector<SingularPosition>& singular) {
  std::vector<std::optional<double>> first_missing(trajectory.columns.size());  // [s], per column
  for (const std::vector<double>& row : trajectory.rows) {
    const auto contains = [&](const SingularPosition& s) { return std::abs(row.front() - s.t) < s.half; };
    if (std::ranges::any_of(singular, contains)) continue;  // their warning names what is missing
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (!std::isfinite(row[k]) && !first_missing[k]) first_missing[k] = row.front();
    }
  }
  for (std::size_t k = 0; k < first_missing.size(); ++k) {
    if (first_missing[k])
      run.warn(
          fmt::format("'{}' is too large for a number at t = {:.6g} s, and empty in trajectory.csv. Look at masses, "
                      "inertias, coordinates and the forces on the bodies",
                      trajectory.columns[k], *first_missing[k]));
  }
  const bool motion_ends_early = interrupted();  // by an earlier Ctrl-C: what there is of it is kept
  const std::function<bool(double)> watch = run.watched("writing trajectory.csv");
  const std::optional<std::string> text = to_csv(trajectory, [&](double t) { return watch(t) || motion_ends_early; });
  run.progress.finish();
  if (!text) return run.stopped("trajectory.csv was not written");
  run.write("trajectory.csv", *text);
  if (run.context.options.mat) run.write("trajectory.mat", to_mat(trajectory));
  if (run.context.options.gnuplot) run.write("trajectory.gp", gnuplot_script(run.problem.scene));
}

}  // namespace mbsopt
