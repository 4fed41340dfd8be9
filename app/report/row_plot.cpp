#include "app/report/row_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "app/report/html_text.hpp"
#include "app/report/line_plot.hpp"

namespace mbsopt::inline app {
namespace {

// The numbers at the left and right end, and fractions of the width between them.
struct RowAxis {
  double low = 0, high = 0;  // zero is always in sight: bars are compared with it

  explicit RowAxis(const RowPlot& plot) {
    if (plot.range) {
      std::tie(low, high) = *plot.range;
      return;
    }
    for (const PlotRow& row : plot.rows) {
      for (const double x : {row.low, row.high, row.ring.value_or(0), row.dot.value_or(0)})
        if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
    }
    const double air = high > low ? 0.05 * (high - low) : 1;
    low -= air;
    high += air;
  }
  std::string percent(double x) const {
    return fmt::format("{:.5g}%", 100 * (std::clamp(std::isnan(x) ? low : x, low, high) - low) / (high - low));
  }
};

// The bars of a row have the height of report.css [px]: their middle is at 13, thin lines lie above it.
std::string bars_of(const PlotRow& row, const RowAxis& axis) {
  const auto bar = [&](const char* style, double from, double to, int top, int bottom) {
    return fmt::format("<line class=\"{}\" x1=\"{}\" x2=\"{}\" y1=\"{}\" y2=\"{}\"/>", style, axis.percent(from),
                       axis.percent(to), top, bottom);
  };
  std::string svg;
  svg += bar(row.high < row.low ? "thick c1" : "thick c0", row.low, row.high, 13, 13);
  if (row.prior) svg += bar("line c1", row.prior->first, row.prior->second, 5, 5);
  for (const double bound : row.bounds)
    if (bound >= axis.low && bound <= axis.high) svg += bar("limit", bound, bound, 5, 21);
  for (const auto& [style, at] : {std::pair("joint", row.ring), std::pair("f7", row.dot)})
    if (at) svg += fmt::format("<circle class=\"{}\" cx=\"{}\" cy=\"13\" r=\"5\"/>", style, axis.percent(*at));
  return svg;
}

}  // namespace

std::string to_svg(const RowPlot& plot) {
  if (plot.rows.empty()) return {};
  const RowAxis axis(plot);
  std::string grid, labels;
  for (const double tick : round_ticks(axis.low, axis.high, 5)) {
    grid += fmt::format("<line class=\"grid\" x1=\"{0}\" x2=\"{0}\" y2=\"100%\"/>", axis.percent(tick));
    labels += fmt::format("<text x=\"{}\" y=\"16\">{:.6g}</text>", axis.percent(tick), tick);
  }
  std::string figure =
      fmt::format("<figure class=\"rows\"><figcaption class=\"title\">{}</figcaption>\n", html_escaped(plot.title));
  for (const PlotRow& row : plot.rows) {
    const std::string name = html_escaped(row.name), words = html_escaped(row.words);
    figure += fmt::format("<div title=\"{0}: {1}\"><span>{0}</span><svg>{2}{3}</svg><span>{1}</span></div>\n", name,
                          words, grid, bars_of(row, axis));
  }
  return figure + fmt::format("<div><svg>{}<text x=\"50%\" y=\"34\">{}</text></svg></div></figure>\n", labels,
                              html_escaped(plot.x_label));
}

}  // namespace mbsopt::inline app
