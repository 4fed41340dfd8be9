#include "app/report/row_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/html_text.hpp"
#include "app/report/line_plot.hpp"

namespace mbsopt::inline app {
namespace {

// Positions in the drawing [px]. On a narrow page names and numbers share a line above their bar.
struct RowLayout {
  const char* name;                      // class of the drawing
  double width, names, words, row, bar;  // words: width right of the bars; bar: its place in the row
  bool stacked;
  int ticks;
};
constexpr RowLayout kLayouts[] = {{"wide", 760, 150, 190, 26, 13, false, 5}, {"narrow", 380, 8, 8, 44, 30, true, 5}};
constexpr double kRowsTop = 8, kRowsBottom = 44;  // margins [px]

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

std::string shortened(const std::string& name, std::size_t most) {
  return name.size() <= most ? name : name.substr(0, most - 1) + "\u2026";
}

std::string drawing_of(const RowPlot& plot, const RowLayout& at) {
  constexpr std::size_t kBesideBars = 20, kAboveBars = 24;  // characters of a name
  constexpr std::size_t kMostWords = 27;                    // characters at their full width
  const auto [low, high] = row_range_of(plot);
  const double inner = at.width - at.names - at.words,
               bottom = kRowsTop + at.row * static_cast<double>(plot.rows.size());
  const auto px = [&, first = low, last = high](double x) {
    return at.names + (std::clamp(std::isfinite(x) ? x : first, first, last) - first) / (last - first) * inner;
  };
  std::string svg = fmt::format("<svg class=\"{}\" viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\">\n",
                                at.name, at.width, bottom + kRowsBottom, html_escaped(plot.title));
  for (const double tick : round_ticks(low, high, at.ticks))
    svg += fmt::format(
        "<path class=\"grid\" d=\"M{0:.1f} {1}V{2:.1f}\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"middle\">{4:.6g}</text>\n",
        px(tick), kRowsTop, bottom, bottom + 16, tick);
  for (std::size_t k = 0; k < plot.rows.size(); ++k) {
    const PlotRow& row = plot.rows[k];
    const double top = kRowsTop + at.row * static_cast<double>(k), y = top + at.bar,
                 text = at.stacked ? top + 16 : y + 4;
    svg += fmt::format("<g><title>{}: {}</title><text x=\"{}\" y=\"{:.1f}\">{}</text>", html_escaped(row.name),
                       html_escaped(row.words), at.stacked ? at.names + 4 : 0, text,
                       html_escaped(shortened(row.name, at.stacked ? kAboveBars : kBesideBars)));
    const std::string squeezed =
        row.words.size() > kMostWords ? " textLength=\"176\" lengthAdjust=\"spacingAndGlyphs\"" : std::string();
    if (plot.track) svg += fmt::format("<path class=\"track\" d=\"M{} {:.1f}h{}\"/>", at.names, y, inner);
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
    svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text></g>\n",
                       at.stacked ? at.width - at.words - 4 : at.width - at.words + 10, text,
                       at.stacked ? "end" : "start", squeezed, html_escaped(row.words));
  }
  return svg + fmt::format(
                   "<rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{:.1f}\"/>\n"
                   "<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n</svg>\n",
                   at.names, kRowsTop, inner, bottom - kRowsTop, at.names + inner / 2, bottom + 36,
                   html_escaped(plot.x_label));
}

}  // namespace

std::string to_svg(const RowPlot& plot) {
  if (plot.rows.empty()) return {};
  std::string figure = fmt::format("<figure><figcaption class=\"title\">{}</figcaption>\n", html_escaped(plot.title));
  for (const RowLayout& layout : kLayouts) figure += drawing_of(plot, layout);
  return figure + "</figure>\n";
}

}  // namespace mbsopt::inline app
