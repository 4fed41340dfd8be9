#include "app/report/line_plot.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cctype>
#include <cmath>
#include <limits>
#include <regex>
#include <string>
#include <vector>

using namespace mbsopt;

namespace {

struct DrawnPoint {
  double x, y;
  bool begins;  // a move leads there, not a line
};

constexpr double kUnit = 1e-6;  // of the frame's width and height

// Where the path of a class goes, in fractions of the frame: relative moves, lines and the zero strokes of points.
std::vector<DrawnPoint> drawn_points(const std::string& svg, const std::string& style) {
  const std::string before = "class=\"" + style + "\" d=\"";
  const std::size_t at = svg.find(before), begin = at + before.size();
  REQUIRE(at != std::string::npos);
  const std::string path = svg.substr(begin, svg.find('"', begin) - begin);
  const std::regex token("[A-Za-z]|-?[0-9]+");
  std::vector<std::string> tokens;
  for (std::sregex_iterator it(path.begin(), path.end(), token), end; it != end; ++it) tokens.push_back(it->str());
  std::vector<DrawnPoint> points;
  double x = 0, y = 0;
  char command = 0;
  for (std::size_t i = 0; i < tokens.size();) {
    if (std::isalpha(static_cast<unsigned char>(tokens[i][0]))) command = tokens[i++][0];
    if (command == 'h') {
      CHECK(tokens.at(i++) == "0");
      continue;
    }
    REQUIRE((command == 'm' || command == 'l'));
    x += kUnit * std::stod(tokens.at(i)), y += kUnit * std::stod(tokens.at(i + 1)), i += 2;
    points.push_back({x, y, command == 'm'});
  }
  return points;
}

}  // namespace

TEST_CASE("ticks are round numbers within the range", "[report]") {
  CHECK(round_ticks(0, 5, 5) == std::vector<double>{0, 1, 2, 3, 4, 5});
  CHECK(round_ticks(-0.3, 0.29, 3) == std::vector<double>{-0.2, 0, 0.2});
  const auto tiny = round_ticks(1.0, 1.0 + 4e-9, 3);
  REQUIRE(tiny.size() >= 2);
  CHECK(tiny[1] - tiny[0] == Approx(2e-9).epsilon(1e-6));
}

TEST_CASE("logarithmic ticks are powers of ten, or 1, 2, 5 where those are few", "[report]") {
  const auto near = [](const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) { return x == Approx(y); });
  };
  CHECK(near(logarithmic_ticks(1e-3, 2e2, 6), {1e-3, 1e-2, 0.1, 1, 10, 100}));
  CHECK(near(logarithmic_ticks(1e-14, 1, 6), {1e-12, 1e-9, 1e-6, 1e-3, 1}));
  CHECK(near(logarithmic_ticks(0.9, 12, 6), {1, 2, 5, 10}));
  const auto narrow = logarithmic_ticks(0.1288, 0.1312, 6);
  REQUIRE(narrow.size() >= 3);
  CHECK(narrow.front() >= 0.1288);
  CHECK(narrow.back() <= 0.1312);
}

TEST_CASE("a convergence plot has readable labels and whole iterations", "[report]") {
  LinePlot plot{.title = "f", .x_label = "iteration", .y_label = "f", .logarithmic_y = true, .whole_x = true};
  plot.series.push_back({"f", {0, 1, 2, 3}, {1, 1e-4, 1e-9, 1e-13}, Mark::line});
  const std::string svg = to_svg(plot);
  CHECK(svg.find(">10<tspan dy=\"-4\" font-size=\"9\">-6</tspan>") != std::string::npos);
  CHECK(svg.find(">1e-") == std::string::npos);
  CHECK(svg.find(">0.5<") == std::string::npos);
  CHECK(svg.find(">2<") != std::string::npos);
  plot.series[0].y = {1, 0.1, 0.02, 0.01};
  CHECK(to_svg(plot).find(">0.01<") != std::string::npos);
}

TEST_CASE("a legend shows lines as they are drawn", "[report]") {
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back({"before", {0, 1}, {0, 1}, Mark::dashed});
  plot.series.push_back({"measured", {0, 1}, {1, 0}, Mark::points});
  plot.series.push_back({"best", {0.5}, {0.5}, Mark::rings});
  const std::string svg = to_svg(plot);
  const std::string legend = svg.substr(svg.find("legend"));
  const auto rings = [](const std::string& text) { return text.find("a4 4 0 1 0 8 0"); };
  CHECK(svg.find("data-at=\"xy\" class=\"line c2\" x=\"50%\" y=\"50%\"") != std::string::npos);
  CHECK(rings(svg) < svg.find("legend"));
  CHECK(rings(legend) < legend.find("best"));
  CHECK(legend.find("class=\"line dashed c0\"") < legend.find("before"));
  CHECK(legend.find("class=\"points c1\"") < legend.find("measured"));
}

TEST_CASE("points that are part of a line have its colour, and no place in the legend", "[report]") {
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back({"first", {0, 1}, {0, 1}, Mark::line});
  plot.series.push_back({"second", {0, 1}, {1, 0}, Mark::line});
  plot.series.push_back({"", {0.5}, {0.25}, Mark::points, 1});
  const std::string svg = to_svg(plot);
  CHECK(svg.find("class=\"points c1\"") != std::string::npos);
  CHECK(svg.find("class=\"points c2\"") == std::string::npos);
  const std::string legend = svg.substr(svg.find("legend"));
  CHECK(legend.find("second") != std::string::npos);
  CHECK(legend.find("points") == std::string::npos);
}

TEST_CASE("values that are not finite interrupt the line and never reach the drawing", "[report]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  LinePlot plot{.title = "a < b", .x_label = "t [s]", .y_label = "y"};
  plot.series.push_back({"y", {0, 1, 2, 3, 4}, {0, 1, nan, 1, 0}, Mark::line});
  const std::string svg = to_svg(plot);
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("a &lt; b") != std::string::npos);
  CHECK(std::ranges::count(drawn_points(svg, "line c0"), true, &DrawnPoint::begins) == 2);
}

TEST_CASE("thinning a long record keeps its highest and lowest value", "[report]") {
  PlotSeries series{"noise", {}, {}, Mark::line};
  for (int i = 0; i < 100'000; ++i) series.x.push_back(i), series.y.push_back(std::sin(i * 0.7));
  series.y[41'234] = 10;  // a spike of one sample
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back(series);
  const std::string svg = to_svg(plot);
  CHECK(svg.size() < 100'000);
  // The range is [-1, 10] with 5 % of air: the spike is drawn at 0.55/12.1 of the height.
  CHECK(std::ranges::min(drawn_points(svg, "line c0"), {}, &DrawnPoint::y).y == Approx(0.55 / 12.1).margin(1e-6));
}

TEST_CASE("a line of many samples is drawn where they are", "[report]") {
  PlotSeries series{"wave", {}, {}, Mark::line};
  for (int i = 0; i <= 1000; ++i) series.x.push_back(i), series.y.push_back(std::cos(i * 0.05));
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back(series);
  const std::vector<DrawnPoint> points = drawn_points(to_svg(plot), "line c0");
  REQUIRE(points.size() == 1001);
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = series.x[i] / 1000, y = (1.1 - series.y[i]) / 2.2;  // 5 % of air
    largest = std::max({largest, std::abs(points[i].x - x), std::abs(points[i].y - y)});
  }
  CHECK(largest < 2e-5);  // the lowest sample lies 3e-5 above -1
}

TEST_CASE("values that differ little beside their size stay apart in the drawing and on the axis", "[report]") {
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back({"far", {0, 1, 2}, {5000.0001, 5000.0002, 5000.0003}, Mark::line});
  const std::string svg = to_svg(plot);
  const std::vector<DrawnPoint> points = drawn_points(svg, "line c0");
  REQUIRE(points.size() == 3);
  CHECK(points[0].y - points[1].y == Approx(points[1].y - points[2].y).epsilon(1e-4));
  CHECK(plot_data(plot).find("5000.0001") == std::string::npos);  // the ends of the axis have some air
  CHECK(svg.find(">5000.0001<") != std::string::npos);
  CHECK(svg.find(">5000.0002<") != std::string::npos);
}

TEST_CASE("the frame cuts no point", "[report]") {
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back({"measured", {0, 1}, {0, 1}, Mark::points});
  const std::string svg = to_svg(plot);
  const std::vector<DrawnPoint> points = drawn_points(svg, "points c0");
  REQUIRE(points.size() == 2);
  CHECK(points[0].x > 4.0 / 332);  // a point has a radius of 1.5 px, the frame on a narrow page 332 px
  CHECK(points[1].x < 1 - 4.0 / 332);
}

TEST_CASE("a constant, an empty and a logarithmic series are drawn", "[report]") {
  LinePlot plot{.title = "flat", .x_label = "t", .y_label = "y"};
  CHECK(to_svg(plot).find("<svg") != std::string::npos);
  plot.series.push_back({"flat", {0, 1}, {3, 3}, Mark::line});
  CHECK(to_svg(plot).find("nan") == std::string::npos);
  plot.logarithmic_y = true;
  plot.series[0].y = {1e-3, 0};
  CHECK(to_svg(plot).find("inf") == std::string::npos);
}

TEST_CASE("on a logarithmic x axis decades are equally wide and values <= 0 are left out", "[report]") {
  LinePlot plot{.title = "", .x_label = "time [s]", .y_label = "error", .logarithmic_y = true, .logarithmic_x = true};
  plot.series.push_back({"dopri5", {1e-3, 1e-2, 0, 1e-1}, {1e-2, 1e-4, 1e-5, 1e-6}, Mark::line});
  const std::string svg = to_svg(plot);
  CHECK(svg.find("inf") == std::string::npos);
  CHECK(svg.find(">0.01<") != std::string::npos);
  const std::vector<DrawnPoint> points = drawn_points(svg, "line c0");
  REQUIRE(points.size() == 3);
  CHECK_FALSE(points[1].begins);
  CHECK(points[2].begins);
  CHECK(points[1].x - points[0].x == Approx(points[2].x - points[1].x).epsilon(1e-3));
}

TEST_CASE("a cloud of many points is thinned at random, and the plot says so", "[report]") {
  // Uniform noise: every tenth of its height holds about a tenth of the points that are drawn.
  PlotSeries noise{"residual", {}, {}, Mark::points};
  for (int i = 0; i < 60'000; ++i) noise.x.push_back(i), noise.y.push_back(std::fmod(i * 0.6180339887498949, 1.0));
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back(noise);
  const std::string svg = to_svg(plot);
  CHECK(svg == to_svg(plot));
  CHECK(svg.find("residual: 5000 of 60000 drawn, at random") != std::string::npos);
  std::vector<int> tenths(10);
  double low = 1e9, high = -1e9;
  std::vector<double> heights;
  for (const DrawnPoint& point : drawn_points(svg, "points c0")) heights.push_back(point.y);
  for (const double y : heights) low = std::min(low, y), high = std::max(high, y);
  for (const double y : heights)
    ++tenths[std::min<std::size_t>(9, static_cast<std::size_t>(10 * (y - low) / (high - low)))];
  CHECK(heights.size() == kMostPoints + 2);
  for (const int count : tenths) CHECK(std::abs(count - 500) < 100);  // 4.7 standard deviations
  plot.series[0].x.resize(kMostPoints), plot.series[0].y.resize(kMostPoints);
  CHECK(to_svg(plot).find("at random") == std::string::npos);
}
