#include "app/report/line_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <utility>

#include "app/files/json_text.hpp"
#include "app/report/html_text.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kUnits = 1e6;    // of the frame's width and of its height in paths: what a zoom resolves
constexpr double kColumns = 672;  // pixels of the widest frame
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
    if (low > high) {
      low = 0;
      high = 1;
    }
    const double smallest = 1e-12 * std::max(std::abs(low), std::abs(high));
    if (span() <= smallest) {
      const double half = low == 0 ? 1 : 0.1 * std::abs(low);
      low -= half;
      high += half;
    } else {
      const double margin = air * span();
      low -= margin;
      high += margin;
    }
  }
};

// Maps positions on the axes to fractions of the frame, from its upper left corner.
struct PlotFrame {
  AxisRange x, y;
  double right(double value) const { return (value - x.low) / x.span(); }
  double down(double value) const { return (y.high - value) / y.span(); }
};

std::string percent(double fraction) { return fmt::format("{:.6g}%", 100 * fraction); }

double x_of(const LinePlot& plot, double value) { return plot.logarithmic_x ? std::log10(value) : value; }
double y_of(const LinePlot& plot, double value) { return plot.logarithmic_y ? std::log10(value) : value; }

// The position of a sample on the axes, unless it is not finite.
std::optional<std::pair<double, double>> place_of(const LinePlot& plot, const PlotSeries& series, std::size_t sample) {
  const double x = x_of(plot, series.x[sample]), y = y_of(plot, series.y[sample]);
  return std::isfinite(x) && std::isfinite(y) ? std::optional(std::pair(x, y)) : std::nullopt;
}

struct MarkStyle {
  const char *style, *key;  // its class; its path in the legend
  const char* symbol;       // a path about each sample, for marks that a path through the samples cannot draw
};
constexpr MarkStyle kMarks[] = {{"line", "M0 5H30", ""},  // in the order of Mark
                                {"line dashed", "M0 5H30", ""},
                                {"points", "M5 5h0M15 5h0M25 5h0", ""},
                                {"line", "M11 5a4 4 0 1 0 8 0a4 4 0 1 0 -8 0", "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0"},
                                {"bars", "M15 0V10", ""},
                                {"cross", "M10 0l10 10m-10 0l10 -10", "M-5 -5l10 10m-10 0l10 -10"}};

const MarkStyle& mark_of(const PlotSeries& series) { return kMarks[static_cast<int>(series.mark)]; }

bool is_cloud(const PlotSeries& series) { return series.mark == Mark::points || *mark_of(series).symbol != 0; }

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
  frame.x.finish(plot.logarithmic_x ? 0.05 : has_marks ? kAirOfMarks : 0);
  frame.y.finish(0.05);
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
  return !is_cloud(series) && series.x.size() > 2 * static_cast<std::size_t>(kColumns) &&
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
    const auto column_of = [&](std::size_t i) { return std::floor(kColumns * frame.right(x_of(plot, series.x[i]))); };
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

// The d of an SVG path, in units of the frame. It contains differences, which are half as long as positions. They lead
// to rounded positions, so that rounding errors do not add up.
class PathText {
 public:
  void move(double right, double down) { go('m', right, down); }
  void line(double right, double down) { go('l', right, down); }
  void dot() { text_ += "h0", command_ = 0; }
  void vertical(double down) {
    const long y = std::lround(kUnits * down);
    text_ += fmt::format("v{}", y - y_);
    command_ = 0;
    y_ = y;
  }
  const std::string& text() const { return text_; }

 private:
  void go(char command, double right, double down) {
    const long x = std::lround(kUnits * right), y = std::lround(kUnits * down);
    if (command != command_ || command == 'm') text_ += command;  // two places after one m are a line
    command_ = command;
    add(x - x_);
    add(y - y_);
    x_ = x;
    y_ = y;
  }

  // Writes a space if no sign separates a number from the one before.
  void add(long units) {
    if (units >= 0 && !text_.empty() && std::isdigit(static_cast<unsigned char>(text_.back()))) text_ += ' ';
    text_ += std::to_string(units);
  }

  std::string text_;
  char command_ = 0;
  long x_ = 0, y_ = 0;  // its end
};

// A drawing in two layers. A zoom shows another part of the curves, which are in units of the frame, and moves the
// others: names and symbols keep their size, and data-at says which of their coordinates follow the zoom.
struct Layers {
  std::string curves, others;
};

std::size_t colour_of(const PlotSeries& series, std::size_t index) {
  return series.colour.value_or(series.part_of.value_or(index)) % kColours;
}

void draw_series(const LinePlot& plot, const PlotFrame& frame, std::size_t index, Layers& layers) {
  const PlotSeries& series = plot.series[index];
  const MarkStyle& mark = mark_of(series);
  const std::string style = fmt::format("class=\"{} c{}\"", mark.style, colour_of(series, index));
  PathText path;
  bool pen_down = false;
  for (const std::size_t i : visible_samples(plot, series, frame)) {
    const auto place = place_of(plot, series, i);
    const bool connected = std::exchange(pen_down, place.has_value() && !is_cloud(series) && series.mark != Mark::bars);
    if (!place) continue;
    const double right = frame.right(place->first), down = frame.down(place->second);
    connected ? path.line(right, down) : path.move(right, down);
    if (series.mark == Mark::points) path.dot();
    if (series.mark == Mark::bars) path.vertical(frame.down(0));
    if (*mark.symbol)
      layers.others +=
          fmt::format("<svg data-series=\"{}\" data-at=\"xy\" {} x=\"{}\" y=\"{}\"><path d=\"{}\"/></svg>\n", index,
                      style, percent(right), percent(down), mark.symbol);
  }
  layers.curves += fmt::format("<path data-series=\"{}\" {} d=\"{}\"/>\n", index, style, path.text());
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
    if (path.text().empty()) path.move(frame.right(x), frame.down(y_limit));
    path.line(frame.right(x), frame.down(beyond ? y : y_limit));
    last = frame.right(x);
  }
  path.line(last, frame.down(y_limit));
  return any ? path.text() + "Z" : std::string();
}

void draw_limits(const LinePlot& plot, const PlotFrame& frame, Layers& layers) {
  constexpr double kUpperEnd = 0.06;  // of the frame: a name there stands below its line
  for (const PlotLimit& limit : plot.limits) {
    const double y = y_of(plot, limit.value), down = frame.down(y);
    if (!(y >= frame.y.low && y <= frame.y.high)) continue;
    for (const PlotSeries& series : plot.series) {
      if (series.mark != Mark::line) continue;
      const std::string area = area_beyond(plot, frame, series, limit);
      if (!area.empty()) layers.curves += fmt::format("<path class=\"beyond\" d=\"{}\"/>\n", area);
    }
    layers.curves += fmt::format("<path class=\"limit\" d=\"M0 {:.0f}h{}\"/>\n", kUnits * down, kUnits);
    layers.others += fmt::format(
        "<text class=\"limit-name\" data-at=\"y\" x=\"100%\" dx=\"-4\" y=\"{}\" dy=\"{}\" "
        "text-anchor=\"end\">{}</text>\n",
        percent(down), down < kUpperEnd ? 14 : -4, html_escaped(limit.name));
  }
}

void draw_instants(const LinePlot& plot, const PlotFrame& frame, Layers& layers) {
  for (const PlotInstant& instant : plot.instants) {
    if (!(instant.x >= frame.x.low && instant.x <= frame.x.high)) continue;
    const double right = frame.right(instant.x);
    layers.curves += fmt::format("<path class=\"limit dashed\" d=\"M{:.0f} 0v{}\"/>\n", kUnits * right, kUnits);
    layers.others += fmt::format(
        "<text class=\"limit-name\" data-at=\"x\" x=\"{}\" dx=\"{}\" y=\"14\" text-anchor=\"{}\">{}</text>\n",
        percent(right), right < 0.5 ? 4 : -4, right < 0.5 ? "start" : "end", html_escaped(instant.name));
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

std::string axes_of(const LinePlot& plot, const PlotFrame& frame) {
  std::string ticks;
  for (const auto& [tick, label] : ticks_of(frame.x, plot.logarithmic_x, 8, plot.whole_x))
    ticks += fmt::format("<line x1=\"{0}\" x2=\"{0}\" y2=\"100%\"/><text x=\"{0}\" y=\"100%\" dy=\"16\">{1}</text>\n",
                         percent(frame.right(tick)), label);
  for (const auto& [tick, label] : ticks_of(frame.y, plot.logarithmic_y, 6))
    ticks += fmt::format(
        "<line y1=\"{0}\" y2=\"{0}\" x2=\"100%\"/><text y=\"{0}\" dx=\"-6\" dy=\"4\" class=\"left\">{1}</text>\n",
        percent(frame.down(tick)), label);
  return fmt::format(
      "<g class=\"ticks\">\n{}</g><rect class=\"frame\" width=\"100%\" height=\"100%\"/>\n"
      "<text class=\"x-label\" x=\"50%\" y=\"100%\" dy=\"36\">{}</text><text class=\"y-label\" x=\"-62\" "
      "y=\"-10\">{}</text>\n",
      ticks, html_escaped(plot.x_label), html_escaped(plot.y_label));
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
  Layers layers;
  draw_limits(plot, frame, layers);
  draw_instants(plot, frame, layers);
  for (std::size_t i = 0; i < plot.series.size(); ++i) draw_series(plot, frame, i, layers);
  std::string svg = fmt::format(
      "<figcaption class=\"title\">{0}</figcaption>\n<svg role=\"img\" aria-label=\"{0}\">\n{1}<svg class=\"curves\" "
      "viewBox=\"0 0 {2} {2}\" preserveAspectRatio=\"none\">\n{3}</svg>\n{4}</svg>\n",
      html_escaped(plot.title), axes_of(plot, frame), kUnits, layers.curves, layers.others);
  if (plot.series.size() > 1) {
    svg += "<div class=\"legend\">";
    for (std::size_t i = 0; i < plot.series.size(); ++i) {
      const PlotSeries& series = plot.series[i];
      const MarkStyle& mark = mark_of(series);
      if (series.part_of) continue;
      svg += fmt::format(
          "<span data-series=\"{}\"><svg class=\"key\" viewBox=\"0 0 30 10\"><path class=\"{} c{}\" "
          "d=\"{}\"/></svg>{}</span>",
          i, mark.style, colour_of(series, i), mark.key, html_escaped(series.name));
    }
    svg += "</div>\n";
  }
  return svg + thinning_note(plot);
}

std::string plot_data(const LinePlot& plot) {
  const PlotFrame frame = frame_of(plot);
  Json series = Json::array();
  for (const PlotSeries& s : plot.series)
    series.push_back({{"name", s.name}, {"part", s.part_of ? static_cast<long>(*s.part_of) : -1}});
  return json_text({{"x", {frame.x.low, frame.x.high}},
                    {"y", {frame.y.high, frame.y.low}},
                    {"log", {{"x", plot.logarithmic_x}, {"y", plot.logarithmic_y}}},
                    {"whole", plot.whole_x},
                    {"series", series}});
}

}  // namespace mbsopt::inline app
