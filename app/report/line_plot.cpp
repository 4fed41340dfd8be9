#include "app/report/line_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <random>
#include <utility>

#include "app/report/html_text.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kPlotWidth = 760, kPlotHeight = 320;               // of the drawing [px]
constexpr double kLeft = 66, kRight = 22, kTop = 26, kBottom = 44;  // margins
constexpr double kInnerWidth = kPlotWidth - kLeft - kRight, kInnerHeight = kPlotHeight - kTop - kBottom;
constexpr int kColours = 8;

struct AxisRange {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void include(double value) { low = std::min(low, value), high = std::max(high, value); }
  double span() const { return high - low; }
  // The digits that resolve a millionth of the range: more than six of values that hardly differ.
  int digits() const {
    const double size = std::max(std::abs(low), std::abs(high));
    return std::clamp(6 + static_cast<int>(std::floor(std::log10(size / span()))), 6, 15);
  }
  // Ensures a range of nonzero length, with a little space at both ends.
  void finish(double air) {
    if (low > high) low = 0, high = 1;
    const double smallest = 1e-12 * std::max(std::abs(low), std::abs(high));
    if (span() <= smallest) {
      const double half = low == 0 ? 1 : 0.1 * std::abs(low);
      low -= half, high += half;
    } else {
      const double margin = air * span();
      low -= margin, high += margin;
    }
  }
};

// Maps data to pixels.
struct PlotFrame {
  AxisRange x, y;
  double px(double value) const { return kLeft + (value - x.low) / x.span() * kInnerWidth; }
  double py(double value) const { return kTop + (y.high - value) / y.span() * kInnerHeight; }
};

double x_of(const LinePlot& plot, double value) { return plot.logarithmic_x ? std::log10(value) : value; }
double y_of(const LinePlot& plot, double value) { return plot.logarithmic_y ? std::log10(value) : value; }

// The position of a sample on the axes, unless it is not finite.
std::optional<std::pair<double, double>> place_of(const LinePlot& plot, const PlotSeries& series, std::size_t sample) {
  const double x = x_of(plot, series.x[sample]), y = y_of(plot, series.y[sample]);
  return std::isfinite(x) && std::isfinite(y) ? std::optional(std::pair(x, y)) : std::nullopt;
}

struct MarkStyle {
  const char *name, *style;         // in the page's data; its class
  const char *key, *drawn;          // paths: in the legend, which ends with `drawn`; at each sample, if it has a symbol
  double left = 0, up = 0, on = 0;  // of the sample, where the symbol begins; how far on it ends [px]
};
constexpr MarkStyle kMarks[] = {{"line", "line", "M0 5H30", ""},  // in the order of Mark
                                {"dashed", "line dashed", "M0 5H30", ""},
                                {"points", "points", "M5 5h0M15 5h0M25 5", "h0"},
                                {"rings", "line", "M11 5", "a4 4 0 1 0 8 0a4 4 0 1 0 -8 0", 4},
                                {"bars", "bars", "M15 0V10", ""},
                                {"crosses", "cross", "M10 0", "l10 10m-10 0l10 -10", 5, 5, 10}};

const MarkStyle& mark_of(const PlotSeries& series) { return kMarks[static_cast<int>(series.mark)]; }

bool is_cloud(const PlotSeries& series) { return *mark_of(series).drawn != 0; }

// The part of the width beside the outermost marks, so that the frame cuts none of them: 4 px of 200.
constexpr double kAirOfMarks = 0.02;

PlotFrame frame_of(const LinePlot& plot) {
  PlotFrame frame;
  for (const PlotSeries& series : plot.series) {
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      const auto place = place_of(plot, series, i);
      if (!place) continue;
      frame.x.include(place->first);
      frame.y.include(place->second);
      if (series.mark == Mark::bars) frame.y.include(0);
    }
  }
  // A limit that is far from all values would flatten them. So only limits within their range, or as far again, are
  // shown.
  const AxisRange data = frame.y;
  for (const PlotLimit& limit : plot.limits) {
    const double y = y_of(plot, limit.value);
    if (y > data.low - data.span() && y < data.high + data.span()) frame.y.include(y);
  }
  const bool has_marks = std::ranges::any_of(
      plot.series, [](const PlotSeries& series) { return is_cloud(series) || series.mark == Mark::bars; });
  const bool wide = plot.equal_axes || plot.logarithmic_x || !plot.x_names.empty();
  frame.x.finish(wide ? 0.05 : has_marks ? kAirOfMarks : 0);
  frame.y.finish(0.05);
  if (plot.equal_axes) {
    const double scale = std::max(frame.x.span() / kInnerWidth, frame.y.span() / kInnerHeight);
    const auto widen = [](AxisRange& range, double span) {
      const double middle = (range.low + range.high) / 2;
      range.low = middle - span / 2, range.high = middle + span / 2;
    };
    widen(frame.x, scale * kInnerWidth);
    widen(frame.y, scale * kInnerHeight);
  }
  return frame;
}

// All samples have the same probability, so that the density of the cloud is right everywhere.
std::vector<std::size_t> random_samples(const std::vector<std::size_t>& all, const std::vector<double>& y) {
  if (all.size() <= kMostPoints) return all;
  std::vector<std::size_t> kept;
  std::sample(all.begin(), all.end(), std::back_inserter(kept), kMostPoints, std::mt19937());
  const auto or_else = [&](double missing) {
    return [&y, missing](std::size_t i) { return std::isnan(y[i]) ? missing : y[i]; };
  };
  kept.push_back(*std::ranges::min_element(all, {}, or_else(INFINITY)));
  kept.push_back(*std::ranges::max_element(all, {}, or_else(-INFINITY)));
  return kept;
}

bool is_thinned(const PlotSeries& series) {
  return !is_cloud(series) && series.x.size() > 2 * static_cast<std::size_t>(kInnerWidth) &&
         std::is_sorted(series.x.begin(), series.x.end());
}

// Reduces the samples of a pixel column to the first, lowest, highest and last: the drawing is the same.
std::vector<std::size_t> visible_samples(const LinePlot& plot, const PlotSeries& series, const PlotFrame& frame) {
  std::vector<std::size_t> all(series.x.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  if (is_cloud(series)) return random_samples(all, series.y);
  if (!is_thinned(series)) return all;
  std::vector<std::size_t> kept;
  for (std::size_t begin = 0; begin < all.size();) {
    const auto column_of = [&](std::size_t i) { return std::floor(frame.px(x_of(plot, series.x[i]))); };
    const double column = column_of(begin);
    std::size_t end = begin, low = begin, high = begin;
    for (; end < all.size() && column_of(end) == column; ++end) {
      if (series.y[end] < series.y[low]) low = end;
      if (series.y[end] > series.y[high]) high = end;
    }
    end = std::max(end, begin + 1);  // a value that is not finite has no column
    for (const std::size_t i : {begin, std::min(low, high), std::max(low, high), end - 1}) {
      if (kept.empty() || kept.back() < i) kept.push_back(i);
    }
    begin = end;
  }
  return kept;
}

// The d of an SVG path. It contains differences in tenths of a px, which are half as long as positions. They lead to
// rounded positions, so that rounding errors do not add up.
class PathText {
 public:
  void move(double px, double py) { go('m', px, py); }
  void line(double px, double py) { go('l', px, py); }
  // Draws at the position and ends there.
  void mark(double px, double py, const MarkStyle& mark) {
    move(px - mark.left, py - mark.up);
    text_ += mark.drawn, command_ = 0;
    x_ += std::lround(10 * mark.on);
  }
  const std::string& text() const { return text_; }

 private:
  void go(char command, double px, double py) {
    const long x = std::lround(10 * px), y = std::lround(10 * py);
    if (command != command_ || command == 'm') text_ += command;  // two places after one m are a line
    command_ = command;
    add(x - x_), add(y - y_);
    x_ = x, y_ = y;
  }

  // Writes 12, -.3, with a space if no sign separates a number from the one before.
  void add(long tenths) {
    if (tenths >= 0 && !text_.empty() && std::isdigit(static_cast<unsigned char>(text_.back()))) text_ += ' ';
    const long size = std::abs(tenths);
    if (tenths < 0) text_ += '-';
    if (size >= 10 || size == 0) text_ += std::to_string(size / 10);
    if (size % 10 != 0) text_ += fmt::format(".{}", size % 10);
  }

  std::string text_;
  char command_ = 0;
  long x_ = 0, y_ = 0;  // its end [0.1 px]
};

std::size_t colour_of(const PlotSeries& series, std::size_t index) {
  return series.colour.value_or(series.part_of.value_or(index)) % kColours;
}

void draw_series(const LinePlot& plot, const PlotFrame& frame, std::size_t index, std::string& svg) {
  const PlotSeries& series = plot.series[index];
  PathText path;
  bool pen_down = false;
  for (const std::size_t i : visible_samples(plot, series, frame)) {
    const auto place = place_of(plot, series, i);
    const bool connected = std::exchange(pen_down, place.has_value());
    if (!place) continue;
    const double px = frame.px(place->first), py = frame.py(place->second);
    if (is_cloud(series)) {
      path.mark(px, py, mark_of(series));
    } else if (series.mark == Mark::bars) {
      path.move(px, frame.py(0)), path.line(px, py);
    } else {
      connected ? path.line(px, py) : path.move(px, py);
    }
  }
  svg += fmt::format("<path data-series=\"{}\" class=\"{} c{}\" d=\"{}\"/>\n", index, mark_of(series).style,
                     colour_of(series, index), path.text());
}

// The area between a limit and the part of a line beyond it.
std::string area_beyond(const LinePlot& plot, const PlotFrame& frame, const PlotSeries& series,
                        const PlotLimit& limit) {
  const double y_limit = y_of(plot, limit.value);
  PathText path;
  bool any = false;
  double last = 0;
  for (const std::size_t i : visible_samples(plot, series, frame)) {
    const auto place = place_of(plot, series, i);
    if (!place) continue;
    const auto [x, y] = *place;
    const bool beyond = limit.upper ? y > y_limit : y < y_limit;
    any = any || beyond;
    if (path.text().empty()) path.move(frame.px(x), frame.py(y_limit));
    path.line(frame.px(x), frame.py(beyond ? y : y_limit));
    last = frame.px(x);
  }
  path.line(last, frame.py(y_limit));
  return any ? path.text() + "Z" : std::string();
}

void draw_limits(const LinePlot& plot, const PlotFrame& frame, std::string& svg) {
  for (const PlotLimit& limit : plot.limits) {
    const double y = y_of(plot, limit.value);
    if (!(y >= frame.y.low && y <= frame.y.high)) continue;
    for (const PlotSeries& series : plot.series) {
      if (series.mark != Mark::line) continue;
      const std::string area = area_beyond(plot, frame, series, limit);
      if (!area.empty()) svg += fmt::format("<path class=\"beyond\" d=\"{}\"/>\n", area);
    }
    const double py = frame.py(y);
    svg += fmt::format(
        "<path class=\"limit\" d=\"M{} {:.1f}h{}\"/><text class=\"limit-name\" x=\"{}\" y=\"{:.1f}\" "
        "text-anchor=\"end\">{}</text>\n",
        kLeft, py, kInnerWidth, kLeft + kInnerWidth - 4, py - kTop < 16 ? py + 14 : py - 4, html_escaped(limit.name));
  }
}

void draw_instants(const LinePlot& plot, const PlotFrame& frame, std::string& svg) {
  for (const PlotInstant& instant : plot.instants) {
    if (!(instant.x >= frame.x.low && instant.x <= frame.x.high)) continue;
    const double px = frame.px(instant.x);
    const bool at_left = px < kLeft + kInnerWidth / 2;  // then the name stands to the right of the line
    svg += fmt::format(
        "<path class=\"limit dashed\" d=\"M{0:.1f} {1}v{2}\"/><text class=\"limit-name\" x=\"{3:.1f}\" y=\"{4}\" "
        "text-anchor=\"{5}\">{6}</text>\n",
        px, kTop, kInnerHeight, px + (at_left ? 4 : -4), kTop + 14, at_left ? "start" : "end",
        html_escaped(instant.name));
  }
}

// Returns whether 0.02, 5, 1000 is a fit form for all ticks of an axis.
bool near_one(const std::vector<double>& ticks) { return ticks.front() > 0.9e-3 && ticks.back() < 1.1e4; }

// 10 with a raised exponent, which reads better than 1e-12.
std::string power_of_ten(double value) {
  const double exponent = std::floor(std::log10(value) + 1e-9), digits = value / std::pow(10, exponent);
  const std::string power = fmt::format("10<tspan dy=\"-4\" font-size=\"9\">{:.0f}</tspan>", exponent);
  return std::abs(digits - 1) < 1e-6 ? power : fmt::format("{:.4g}\u00b7{}", digits, power);
}

// Positions on an axis (logarithms if it is logarithmic) and their labels.
using Ticks = std::vector<std::pair<double, std::string>>;

Ticks ticks_of(const AxisRange& range, bool logarithmic, int count, bool whole = false) {
  const std::vector<double> values = logarithmic
                                         ? logarithmic_ticks(std::pow(10, range.low), std::pow(10, range.high), count)
                                         : round_ticks(range.low, range.high, count);
  Ticks ticks;
  for (const double value : values) {
    if (!logarithmic && !(whole && value != std::round(value)))
      ticks.emplace_back(value, fmt::format("{:.{}g}", value, range.digits()));
    if (logarithmic)
      ticks.emplace_back(std::log10(value), near_one(values) ? fmt::format("{:.6g}", value) : power_of_ten(value));
  }
  return ticks;
}

Ticks x_ticks_of(const LinePlot& plot, const PlotFrame& frame) {
  if (plot.x_names.empty()) return ticks_of(frame.x, plot.logarithmic_x, 8, plot.whole_x);
  Ticks names;
  for (const std::string& name : plot.x_names)
    names.emplace_back(static_cast<double>(names.size()), html_escaped(name));
  return names;
}

void draw_axes(const LinePlot& plot, const PlotFrame& frame, std::string& svg) {
  const double bottom = kTop + kInnerHeight, right = kLeft + kInnerWidth;
  std::string grid, x_labels, y_labels;
  for (const auto& [tick, label] : x_ticks_of(plot, frame)) {
    const double px = frame.px(tick);
    grid += fmt::format("M{:.1f} {}V{}", px, kTop, bottom);
    x_labels += fmt::format("<text x=\"{:.1f}\" y=\"{}\">{}</text>", px, bottom + 16, label);
  }
  for (const auto& [tick, label] :
       ticks_of(frame.y, plot.logarithmic_y, plot.logarithmic_y || !plot.equal_axes ? 6 : 5)) {
    const double py = frame.py(tick);
    grid += fmt::format("M{} {:.1f}H{}", kLeft, py, right);
    y_labels += fmt::format("<text x=\"{}\" y=\"{:.1f}\">{}</text>", kLeft - 6, py + 4, label);
  }
  svg += fmt::format(
      "<g class=\"ticks\"><path class=\"grid\" d=\"{}\"/>\n<g text-anchor=\"middle\">{}</g>\n"
      "<g text-anchor=\"end\">{}</g></g>\n<rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\n"
      "<text class=\"x-label\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n"
      "<text class=\"y-label\" x=\"4\" y=\"16\">{}</text>\n",
      grid, x_labels, y_labels, kLeft, kTop, kInnerWidth, kInnerHeight, kLeft + kInnerWidth / 2, kPlotHeight - 8,
      html_escaped(plot.x_label), html_escaped(plot.y_label));
}

// Says which part of long series the plot draws.
std::string thinning_note(const LinePlot& plot) {
  std::string note;
  if (std::ranges::any_of(plot.series, is_thinned)) note += "Drawn: first, lowest, highest, last of each pixel. ";
  for (const PlotSeries& series : plot.series)
    if (is_cloud(series) && series.x.size() > kMostPoints)
      note += fmt::format("{}: {} of {} drawn, at random. ", html_escaped(series.name), kMostPoints, series.x.size());
  return note.empty() ? note : fmt::format("<p class=\"note\">{}</p>\n", note.substr(0, note.size() - 1));
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  const double raw = (high - low) / count;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  const double step = power * (raw <= power ? 1 : raw <= 2 * power ? 2 : raw <= 5 * power ? 5 : 10);
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) ticks.push_back(k * step + 0.0);
  return ticks;
}

std::vector<double> logarithmic_ticks(double low, double high, int count) {
  const double first = std::ceil(std::log10(low) - 1e-9), last = std::floor(std::log10(high) + 1e-9);
  if (last - first >= 2) {
    const double stride = std::max(1.0, std::ceil((last - first) / count));
    std::vector<double> ticks;
    // Takes multiples of the stride, so that 1 is among them if it is in the range.
    for (double k = std::ceil(first / stride) * stride; k <= last; k += stride) ticks.push_back(std::pow(10, k));
    return ticks;
  }
  std::vector<double> ticks;
  for (double k = first - 1; k <= last; ++k) {
    for (const double digit : {1, 2, 5}) {
      const double tick = digit * std::pow(10, k);
      if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push_back(tick);
    }
  }
  if (ticks.size() >= 3) return ticks;
  ticks = round_ticks(low, high, count);
  std::erase_if(ticks, [](double tick) { return tick <= 0; });
  return ticks;
}

std::string to_svg(const LinePlot& plot) {
  const PlotFrame frame = frame_of(plot);
  std::string svg = fmt::format("<figcaption class=\"title\">{}</figcaption>\n", html_escaped(plot.title));
  svg += fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n", kPlotWidth, kPlotHeight,
                     html_escaped(plot.title));
  draw_axes(plot, frame, svg);
  draw_limits(plot, frame, svg);
  draw_instants(plot, frame, svg);
  for (std::size_t i = 0; i < plot.series.size(); ++i) draw_series(plot, frame, i, svg);
  svg += "</svg>\n";
  if (plot.series.size() > 1) {
    svg += "<div class=\"legend\">";
    for (std::size_t i = 0; i < plot.series.size(); ++i) {
      const PlotSeries& series = plot.series[i];
      const MarkStyle& mark = mark_of(series);
      if (series.part_of) continue;
      svg += fmt::format(
          "<span data-series=\"{}\"><svg class=\"key\" viewBox=\"0 0 30 10\"><path class=\"{} c{}\" "
          "d=\"{}{}\"/></svg>{}</span>",
          i, mark.style, colour_of(series, i), mark.key, mark.drawn, html_escaped(series.name));
    }
    svg += "</div>\n";
  }
  return svg + thinning_note(plot);
}

std::string plot_data(const LinePlot& plot, PageArrays& arrays) {
  constexpr int kTimeDigits = 9;  // of x: 1000.001 s and 1000.002 s are two instants
  const PlotFrame frame = frame_of(plot);
  const auto series_json = [&](const PlotSeries& s) {
    std::vector<double> x, y;
    for (const std::size_t i : visible_samples(plot, s, frame)) x.push_back(s.x[i]), y.push_back(s.y[i]);
    return fmt::format(R"({{"name":{},"mark":"{}","part":{},"x":{},"y":{}}})", json_quoted(s.name), mark_of(s).name,
                       s.part_of ? static_cast<long>(*s.part_of) : -1,
                       arrays.add(x, std::max(kTimeDigits, frame.x.digits())), arrays.add(y, frame.y.digits()));
  };
  const auto limit_json = [](const PlotLimit& limit) {
    return fmt::format(R"({{"name":{},"value":{:.9g},"upper":{}}})", json_quoted(limit.name), limit.value, limit.upper);
  };
  const auto instant_json = [](const PlotInstant& instant) {
    return fmt::format(R"({{"name":{},"x":{:.9g}}})", json_quoted(instant.name), instant.x);
  };
  return fmt::format(R"({{"x":[{},{}],"y":[{},{}],"logx":{},"logy":{},"whole":{},"equal":{},"xlabel":{},"ylabel":{},)"
                     R"("series":{},"limits":{},"instants":{},"names":{}}})",
                     frame.x.low, frame.x.high, frame.y.low, frame.y.high, plot.logarithmic_x, plot.logarithmic_y,
                     plot.whole_x, plot.equal_axes, json_quoted(plot.x_label), json_quoted(plot.y_label),
                     json_list(plot.series, series_json), json_list(plot.limits, limit_json),
                     json_list(plot.instants, instant_json), json_list(plot.x_names, json_quoted));
}

}  // namespace mbsopt::inline app
