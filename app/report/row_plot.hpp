// Rows of bars along one axis, as an HTML figure: intervals of estimates, variables between their bounds, sizes of
// effects. The page's style puts the name and the words of a row beside its bars, or above them on a narrow page.
//
//   RowPlot plot{.title = "Effect of 1 %", .x_label = "p dpsi/dp / psi [-]"};
//   plot.rows.push_back({.name = "k", .low = 0, .high = 0.3, .words = "0.3"});
//   page.drawing(to_svg(plot));
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace mbsopt::inline app {

struct PlotRow {
  std::string name;
  double low = 0, high = 0;                             // the bar
  std::optional<double> ring = {};                      // a starting value
  std::optional<double> dot = {};                       // a final value
  std::vector<double> bounds = {};                      // bounds outside the plot are not drawn
  std::optional<std::pair<double, double>> prior = {};  // an interval, drawn thin above the bar
  std::string words = {};                               // at the right, with the numbers
};

struct RowPlot {
  std::string title, x_label;
  std::vector<PlotRow> rows = {};
  std::optional<std::pair<double, double>> range = {};  // else that of the bars; what is outside ends at the edge
};

// Returns an empty string without rows.
std::string to_svg(const RowPlot& plot);

}  // namespace mbsopt::inline app
