#include "app/report/line_plot.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <regex>

using namespace mbsopt;

TEST_CASE("ticks are round numbers within the range", "[report]") {
  CHECK(round_ticks(0, 5, 5) == std::vector<double>{0, 1, 2, 3, 4, 5});
  CHECK(round_ticks(-0.3, 0.29, 3) == std::vector<double>{-0.2, 0, 0.2});
  const auto tiny = round_ticks(1.0, 1.0 + 4e-9, 3);
  REQUIRE(tiny.size() >= 2);
  CHECK(tiny[1] - tiny[0] == Approx(2e-9).epsilon(1e-6));
}

TEST_CASE("values that are not finite interrupt the line and never reach the drawing", "[report]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  LinePlot plot{.title = "a < b", .x_label = "t [s]", .y_label = "y"};
  plot.series.push_back({"y", {0, 1, 2, 3, 4}, {0, 1, nan, 1, 0}, Mark::line});
  const std::string svg = to_svg(plot);
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("a &lt; b") != std::string::npos);
  std::smatch line;
  REQUIRE(std::regex_search(svg, line, std::regex("class=\"line c0\" d=\"([^\"]*)\"")));
  const std::string path = line[1];
  CHECK(std::count(path.begin(), path.end(), 'M') == 2);
}

TEST_CASE("thinning a long record keeps its highest and lowest value", "[report]") {
  PlotSeries series{"noise", {}, {}, Mark::line};
  for (int i = 0; i < 100'000; ++i) series.x.push_back(i), series.y.push_back(std::sin(i * 0.7));
  series.y[41'234] = 10;  // a spike of one sample
  LinePlot plot{.title = "", .x_label = "", .y_label = ""};
  plot.series.push_back(series);
  const std::string svg = to_svg(plot);
  CHECK(svg.size() < 100'000);
  // The range is [-1, 10] with 5 % of air: the spike is drawn at 30 + 0.55/12.1 * 246 px.
  CHECK(svg.find(" 41.2") != std::string::npos);
}

TEST_CASE("a constant, an empty and a logarithmic series are drawn", "[report]") {
  LinePlot plot{.title = "flat", .x_label = "t", .y_label = "y"};
  CHECK(to_svg(plot).find("<svg") == 0);
  plot.series.push_back({"flat", {0, 1}, {3, 3}, Mark::line});
  CHECK(to_svg(plot).find("nan") == std::string::npos);
  plot.logarithmic_y = true;
  plot.series[0].y = {1e-3, 0};
  CHECK(to_svg(plot).find("inf") == std::string::npos);
}
