// A trajectory as plots over time: sensors grouped by unit. A scene without sensors shows the bodies' positions.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/report/line_plot.hpp"
#include "app/results/trajectory_csv.hpp"

namespace mbsopt::inline app {

std::vector<double> column(const Trajectory& table, std::size_t index);
// A column over the first one; nothing without that column or without rows.
std::optional<PlotSeries> series_of(const Trajectory& table, const std::string& name, Mark mark = Mark::line);

std::vector<LinePlot> motion_plots(const Scene& scene, const Trajectory& trajectory);
// Limits of sensors over the whole run, by the names of the sensors.
using SensorLimits = std::vector<std::pair<std::string, PlotLimit>>;
// The same plots with a second run dashed: before (dashed) and after.
std::vector<LinePlot> motion_plots(const Scene& scene, const Trajectory& before, const Trajectory& after,
                                   const SensorLimits& limits = {});

}  // namespace mbsopt::inline app
