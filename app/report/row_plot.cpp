#include "app/report/row_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/html_text.hpp"
#include "app/report/line_plot.hpp"

namespace mbsopt {
namespace {

constexpr double kRowsWidth = 760, kNamesWidth = 150, kWordsWidth = 190, kRowsTop = 34, kRowsBottom = 44,
                 kRow = 26;  // [px]

std::pair<double, double> row_range_of(const RowPlot& plot) {
  if (plot.range) return *plot.range;
  double low = 0, high = 0;  // zero is always in sight: bars are compared with it
  for (const PlotRow& row : plot.rows) {
    for (const double x : {row.low, row.high, row.ring.value_or(0), row.dot.value_or(0)})
      if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  }
  const double air = high > low ? 0.05 * (high - low) : 1;
  return {low - air, high + air};
}

std::string shortened(const std::string& name) {
  constexpr std::size_t kMost = 20;  // characters left of the bars
  return name.size() <= kMost ? name : name.substr(0, kMost - 1) + "\u2026";
}

}  // namespace

std::string to_svg(const RowPlot& plot) {
  if (plot.rows.empty()) return {};
  const auto [low, high] = row_range_of(plot);
  const double inner = kRowsWidth - kNamesWidth - kWordsWidth,
               bottom = kRowsTop + kRow * static_cast<double>(plot.rows.size());
  const auto px = [&, first = low, last = high](double x) {
    return kNamesWidth + (std::clamp(std::isfinite(x) ? x : first, first, last) - first) / (last - first) * inner;
  };
  std::string svg = fmt::format("<figure><svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\">\n", kRowsWidth,
                                bottom + kRowsBottom, html_escaped(plot.title));
  svg += fmt::format("<text class=\"title\" x=\"0\" y=\"18\">{}</text>\n", html_escaped(plot.title));
  for (const double tick : round_ticks(low, high, 5))
    svg += fmt::format(
        "<path class=\"grid\" d=\"M{0:.1f} {1}V{2:.1f}\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"middle\">{4:.6g}</text>\n",
        px(tick), kRowsTop, bottom, bottom + 16, tick);
  for (std::size_t k = 0; k < plot.rows.size(); ++k) {
    const PlotRow& row = plot.rows[k];
    const double y = kRowsTop + kRow * (static_cast<double>(k) + 0.5);
    svg += fmt::format("<g><title>{}: {}</title><text x=\"0\" y=\"{:.1f}\">{}</text>", html_escaped(row.name),
                       html_escaped(row.words), y + 4, html_escaped(shortened(row.name)));
    if (plot.track) svg += fmt::format("<path class=\"track\" d=\"M{} {:.1f}h{}\"/>", kNamesWidth, y, inner);
    svg += fmt::format("<path class=\"thick c{}\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", row.high < row.low ? 1 : 0,
                       px(row.low), y, px(row.high));
    if (row.prior)
      svg += fmt::format("<path class=\"line c1\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", px(row.prior->first), y - 8,
                         px(row.prior->second));
    for (const double bound : row.bounds)
      if (bound >= low && bound <= high)
        svg += fmt::format("<path class=\"limit\" d=\"M{:.1f} {:.1f}v16\"/>", px(bound), y - 8);
    if (row.ring) svg += fmt::format("<circle class=\"joint\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>", px(*row.ring), y);
    if (row.dot) svg += fmt::format("<circle class=\"f7\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>", px(*row.dot), y);
    svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\">{}</text></g>\n", kRowsWidth - kWordsWidth + 10, y + 4,
                       html_escaped(row.words));
  }
  svg += fmt::format("<rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{:.1f}\"/>\n", kNamesWidth,
                     kRowsTop, inner, bottom - kRowsTop);
  return svg +
         fmt::format("<text class=\"label\" x=\"{}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n</svg></figure>\n",
                     kNamesWidth + inner / 2, bottom + 36, html_escaped(plot.x_label));
}

}  // namespace mbsopt
