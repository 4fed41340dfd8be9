// The page report.html of a run: its input, its numbers, its plots. What a command prints, too, goes to both by one
// call. The page has no time of day and no seconds of computing, so the same inputs give the same bytes; only that of
// `tradeoff` shows seconds, because it measures them.
//
//   RunPage page(run);
//   page.heading("Objectives"), page.both(objective_table(run.result));
//   page.write();
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/report/html_page.hpp"
#include "app/report/line_plot.hpp"
#include "app/report/motion_scene.hpp"
#include "app/results/recorded_motion.hpp"
#include "app/run/run.hpp"

namespace mbsopt::inline app {

class RunPage : public HtmlPage {
 public:
  explicit RunPage(Run& run);
  Run& run;

  void print(const TextTable& shown);  // at the terminal, after an empty line
  void both(const TextTable& shown);   // there, and in the page
  void say(std::string_view words);    // likewise: a line, and small print
  // Writes the page. Its top says how the run ended, with all warnings; its end has the mechanism and the provenance.
  void write();
};

std::vector<std::string> objective_values(const Json& objectives);          // "path = 1.23 m^2 s", ...
std::string unit_per(const std::string& unit, const std::string& divisor);  // "N/m", "m" to "N/m^2"

// Sections of the page.
void add_objectives(RunPage& page);                      // name and value
void add_simulation(RunPage& page, const Scene& scene);  // steps, violations, energy
// The derivatives of all objectives in all parameters, and what a change of each parameter does.
TextTable gradient_table(const Run& run);
void add_gradients(RunPage& page);
// Objective, infeasibility and parameters over iterations: the columns of history.csv. unit is that of the objective.
void add_convergence(RunPage& page, const Trajectory& history, const std::string& unit = "-");
void add_multistart(RunPage& page);  // the waterfall, where there is one
// A column over the first one; nothing without that column or without rows.
std::optional<PlotSeries> series_of(const Trajectory& table, const std::string& name, Mark mark = Mark::line);
// The moving mechanism, above drawings of its start and end that replace it without a script.
void add_motion(HtmlPage& page, const std::vector<MovingState>& states);
// Limits of sensors over the whole run, by the names of the sensors.
using SensorLimits = std::vector<std::pair<std::string, PlotLimit>>;
// Plots of the sensors over time, before (dashed) and after.
void add_compared_motions(HtmlPage& page, const Scene& scene, const Trajectory& before, const Trajectory& after,
                          const SensorLimits& limits);
// All of a simulation: verdict, objectives, motion, plots, sensors, steps. The plots over time mark the instants.
void add_simulated_motion(RunPage& page, const Scene& scene, const RecordedMotion& motion,
                          const std::vector<PointTarget>& targets, const std::vector<PlotInstant>& instants = {});

// "all 10 starts" or "3 of 10 starts" of the entry "multistart".
std::string counted_starts(const Json& multistart);
// "all 10 starts, seed 7: 2 at the best optimum", "... : the best one has not converged (iteration_limit)".
std::string starts_in_words(const Json& multistart);

// "optimum" if the optimiser converged, else "best point": the end of its search. status: as in result.json.
const char* end_of_search(std::string_view status);

// The place of a value between the bounds of a parameter, from 0 to 1, by its logarithm if that is its scale. Empty
// without two bounds. `name` may be "run1.k"; p is an entry of result["parameters"].
std::function<double(double value)> place_between_bounds(const Scene& scene, const std::string& name, const Json& p);

}  // namespace mbsopt::inline app
