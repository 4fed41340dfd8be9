#include "app/report/mechanism_drawing.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <regex>

#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The pendulum's bar of 1 m turned about z by an angle, at rest.
std::vector<double> bar_at(double angle) {
  return {0, 0, 0, 0, std::cos(angle / 2), 0, 0, std::sin(angle / 2), 0, 0, 0, 0, 0, 0};
}

Scene drawn_pendulum() {
  Scene scene = pendulum();
  scene.bodies[0].points["tip"] = {1.0, 0.0, 0.0};
  return scene;
}

// The ends of the first body's path.
std::vector<double> numbers_of_body(const std::string& svg, std::size_t which = 0) {
  const std::regex body("class=\"body c0 f0\" d=\"([^\"]*)\"");
  auto match = std::sregex_iterator(svg.begin(), svg.end(), body);
  std::advance(match, which);
  const std::string path = (*match)[1];
  const std::regex number("-?[0-9.]+");
  std::vector<double> numbers;
  for (auto it = std::sregex_iterator(path.begin(), path.end(), number); it != std::sregex_iterator(); ++it)
    numbers.push_back(std::stod(it->str()));
  return numbers;
}

}  // namespace

TEST_CASE("the plane of a drawing is the one in which the mechanism moves most", "[report]") {
  const Scene scene = drawn_pendulum();
  Trajectory swing{{}, {bar_at(0), bar_at(0.5), bar_at(1)}};
  CHECK(plane_of_motion(scene, swing).axes == std::array{0, 1});
  // About y instead: in x and z.
  for (auto& row : swing.rows) std::swap(row[6], row[7]), std::swap(row[5], row[6]), std::swap(row[5], row[7]);
  for (auto& row : swing.rows) row[6] = std::sqrt(1 - row[4] * row[4]), row[5] = row[7] = 0;
  CHECK(plane_of_motion(scene, swing).axes == std::array{0, 2});
  // Nothing moves: where it is spread most.
  CHECK(plane_of_motion(scene, {{}, {bar_at(1.2), bar_at(1.2)}}).axes == std::array{0, 1});
  CHECK_NOTHROW(plane_of_motion(scene, {}));
}

TEST_CASE("a body is drawn where its points are, on one scale in both directions", "[report]") {
  const Scene scene = drawn_pendulum();
  const std::vector<double> level = bar_at(0), upright = bar_at(M_PI / 2);
  const std::string svg = mechanism_drawing("a < b", {0, 1}, {{"start", scene, level}, {"end", scene, upright}});
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("a &lt; b, seen in the x-y plane") != std::string::npos);
  CHECK(svg.find("class=\"earlier\"") != std::string::npos);
  CHECK(svg.find(">start</span>") != std::string::npos);
  const std::vector<double> first = numbers_of_body(svg, 0), last = numbers_of_body(svg, 1);
  REQUIRE(first.size() == 4);  // two ends: the centre of mass lies between them
  REQUIRE(last.size() == 4);
  CHECK(first[1] == Approx(first[3]));
  CHECK(last[0] == Approx(last[2]));
  CHECK(std::abs(first[2] - first[0]) == Approx(std::abs(last[3] - last[1])).margin(0.2));
}

TEST_CASE("springs and bodies of three points are drawn, directions are no points", "[report]") {
  Scene scene = drawn_pendulum();
  scene.bodies[0].points["side"] = {0.5, 0.3, 0.0};
  scene.bodies[0].points["up"] = {0.0, 0.0, 50.0};
  scene.joints[0].axis2 = "up";
  Tsda spring;
  spring.body2 = "bar", spring.point2 = "tip", spring.point1 = VectorField{1.0, 1.0, 0.0};
  scene.forces.push_back({"s", spring});
  const std::vector<double> row = bar_at(0);
  const std::string svg = mechanism_drawing("one", {0, 1}, {{"start", scene, row}});
  CHECK(svg.find("class=\"mark spring\"") != std::string::npos);
  CHECK(numbers_of_body(svg).size() == 6);
  CHECK(plane_of_motion(scene, {{}, {row, row}}).axes == std::array{0, 1});  // 50 m along z are no part of it
  CHECK(mechanism_drawing("none", {0, 1}, {}).empty());
}

TEST_CASE("the name of a bar stands beside it, away from its earlier position", "[report]") {
  const Scene scene = drawn_pendulum();
  const std::regex label("<text x=\"([0-9.]+)\" y=\"([0-9.]+)\"( text-anchor=\"end\")?>");
  for (const double angle : {0.8, 2.3, 4.0, 5.5}) {
    for (const double earlier : {angle, angle + 0.2, angle - 0.2}) {
      const std::string svg =
          mechanism_drawing("one", {0, 1}, {{"first", scene, bar_at(earlier)}, {"last", scene, bar_at(angle)}});
      std::smatch found;
      REQUIRE(std::regex_search(svg, found, label));
      const auto off = [&](const std::vector<double>& bar, double x, double y) {
        const double dx = bar[2] - bar[0], dy = bar[3] - bar[1];
        return (dx * (y - bar[1]) - dy * (x - bar[0])) / std::hypot(dx, dy);  // signed distance
      };
      const double x = std::stod(found[1]), y = std::stod(found[2]), wide = found[3].matched ? -40 : 40;
      const std::vector<double> last = numbers_of_body(svg, 1);
      INFO(angle << ' ' << earlier);
      const double side = off(last, x, y);
      for (const double corner_x : {x, x + wide})
        for (const double corner_y : {y, y - 9}) CHECK(side * off(last, corner_x, corner_y) > 0);
      if (earlier == angle) continue;
      const std::vector<double> first = numbers_of_body(svg, 0);
      CHECK(side * off(last, (first[0] + first[2]) / 2, (first[1] + first[3]) / 2) < 0);
    }
  }
}

TEST_CASE("a drawing follows the values of the parameters", "[report]") {
  Scene scene = pendulum();
  scene.bodies[0].points["tip"] = {f("c"), 0.0, 0.0};
  const std::vector<double> row = bar_at(0);
  Eigen::VectorXd rho = nominal(scene);
  rho(0) *= 2;
  const Scene longer = with_values(scene, rho);
  const std::string svg = mechanism_drawing("longer", {0, 1}, {{"before", scene, row}, {"after", longer, row}});
  const std::vector<double> before = numbers_of_body(svg, 0), after = numbers_of_body(svg, 1);
  CHECK(std::abs(after[2] - after[0]) == Approx(2 * std::abs(before[2] - before[0])).margin(0.2));
}

TEST_CASE("a drawing of any size has a scale of a round length", "[report]") {
  for (double length = 1e-3; length < 1e4; length *= 1.07) {
    Scene scene = pendulum();
    scene.bodies[0].points["tip"] = {length, 0.0, 0.0};
    const std::vector<double> level = bar_at(0);
    std::string svg;
    INFO(length);
    REQUIRE_NOTHROW(svg = mechanism_drawing("bar", {0, 1}, {{"start", scene, level}}));
    const std::regex scale(">([0-9.e+-]+) m</text>");
    std::smatch found;
    REQUIRE(std::regex_search(svg, found, scale));
    const double shown = std::stod(found[1]), digit = shown / std::pow(10, std::floor(std::log10(shown) + 1e-9));
    CHECK((std::abs(digit - 1) < 1e-9 || std::abs(digit - 2) < 1e-9 || std::abs(digit - 5) < 1e-9));
    CHECK(shown < length);
  }
}

TEST_CASE("a mechanism of the largest numbers is drawn or left out", "[report]") {
  Scene scene = pendulum();
  constexpr double kHalf = std::numeric_limits<double>::max() / 2;
  scene.bodies[0].points["tip"] = {kHalf, 0.0, 0.0};
  const std::vector<double> left = bar_at(M_PI), right = bar_at(0);
  const std::string svg = mechanism_drawing("bar", {0, 1}, {{"start", scene, right}});
  CHECK_FALSE(svg.empty());
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("inf") == std::string::npos);
  // With its margins the drawing is wider than the largest number.
  CHECK(mechanism_drawing("bar", {0, 1}, {{"start", scene, left}, {"end", scene, right}}).empty());
  // The drawing is wider than it is high, so that its width overflows.
  const std::vector<double> upright = bar_at(M_PI / 2);
  CHECK(mechanism_drawing("bar", {0, 1}, {{"start", scene, upright}}).empty());
  scene.bodies[0].points["tip"] = {2 * kHalf, 2 * kHalf, 0.0};
  const std::vector<double> turned = bar_at(M_PI / 4);
  CHECK(mechanism_drawing("bar", {0, 1}, {{"start", scene, turned}}).empty());
}
