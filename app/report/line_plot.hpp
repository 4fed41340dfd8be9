// A line plot as HTML text with an SVG in it: a title, axes with round numbers and units in the labels, a legend.
// Colours and margins come from the page's style. Places are fractions of the frame, so that the drawing fits each
// width and the page's script can zoom into it and read its values.
//
// A line of many samples keeps the first, lowest, highest and last of every pixel column, which draws the same. Points
// are a cloud, and such a choice would change its density. Beyond kMostPoints the plot draws a random part of them
// (always the same), with the lowest and the highest, and says so.
//
//   LinePlot plot{.title = "Angle", .x_label = "t [s]", .y_label = "angle [rad]"};
//   plot.series.push_back({"model", t, angle});
//   plot.series.push_back({"measured", t_k, z, Mark::points});
//   page.plot(plot);
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace mbsopt::inline app {

enum class Mark { line, dashed, points, rings, bars, crosses };  // bars: from zero to y

struct PlotSeries {
  std::string name;
  std::vector<double> x, y;  // values that are not finite are left out
  Mark mark = Mark::line;
  std::optional<std::size_t> part_of = {};  // takes that series' colour, and no place in the legend
  std::optional<std::size_t> colour = {};   // else the number of the series
};

// A horizontal line that no series should pass; the part of a series beyond it is shaded.
struct PlotLimit {
  std::string name;
  double value = 0;
  bool upper = true;  // else a lower limit
};

// A vertical line at which something happens.
struct PlotInstant {
  std::string name;
  double x = 0;
};

struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<PlotSeries> series = {};
  bool logarithmic_y = false;  // values <= 0 are left out
  bool logarithmic_x = false;  // x <= 0 are left out
  bool whole_x = false;        // x counts: ticks at whole numbers only
  std::vector<PlotLimit> limits = {};
  std::vector<PlotInstant> instants = {};
};

inline constexpr std::size_t kMostPoints = 5000;  // of a series: some 100 kB of the page

std::string to_svg(const LinePlot& plot);

// Returns what the page's script does not read from the drawing: ranges of the axes, names of the series; as JSON.
std::string plot_data(const LinePlot& plot);

// About `count` round numbers (1, 2 or 5 times a power of ten) that cover [low, high].
std::vector<double> round_ticks(double low, double high, int count);

// The same on a logarithmic axis, low > 0: powers of ten, with a stride if there are too many. If there are few, it
// takes 1, 2, 5 times powers of ten; if there are none, round numbers.
std::vector<double> logarithmic_ticks(double low, double high, int count);

}  // namespace mbsopt::inline app
