// Functions through samples, and the expressions that use them.
#include "core/expression/curve.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "core/expression/program.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

const std::vector<double> kX{-1, 0, 0.5, 2}, kY{2, 1, -1, 3};

double value_of(const std::string& text, double x, double p = 0) {
  Symbols symbols;
  symbols.add_input("x"), symbols.add_input("p");
  const Program program(Expression::parse(text), symbols);
  Program::Scratch scratch = program.scratch();
  return program.value(std::vector{x, p}, scratch);
}

Curve spline_through(std::vector<double> x, std::vector<double> y) {
  return {Interpolation::spline, std::move(x), std::move(y)};
}

std::string error_of(const std::string& text) {
  try {
    Expression::parse(text);
  } catch (const ExpressionError& error) {
    return error.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("hold keeps the last sample, linear joins the samples, the first and last piece go on", "[curve]") {
  const Curve hold(Interpolation::hold, kX, kY), linear(Interpolation::linear, kX, kY);
  CHECK(hold.at(-3) == 2);
  CHECK(hold.at(-0.001) == 2);
  CHECK(hold.at(0) == 1);
  CHECK(hold.at(9) == 3);
  CHECK(hold.at(0.2, 1) == 0);
  CHECK(linear.at(-2) == 3);
  CHECK(linear.at(0.25) == 0);
  CHECK(linear.at(0.25, 1) == -4);
  CHECK(linear.at(0.5, 1) == Approx(4 / 1.5));  // to its right
  CHECK(linear.at(3.5) == Approx(7));
  CHECK(linear.at(0.25, 2) == 0);
  CHECK(linear.change_at(1) == -3);
  CHECK(hold.change_at(2) == -2);
}

TEST_CASE("derivatives of a spline up to the third are those of its cubics", "[curve]") {
  const auto cubic = [](double x) { return 1 - 2 * x + 0.5 * x * x + 3 * x * x * x; };
  std::vector<double> y;
  for (const double x : kX) y.push_back(cubic(x));
  const Curve spline(Interpolation::spline, kX, y);  // not-a-knot: reproduces cubics
  CHECK(spline.at(1.3) == Approx(cubic(1.3)));
  CHECK(spline.at(1.3, 1) == Approx(-2 + 1.3 + 9 * 1.3 * 1.3));
  CHECK(spline.at(1.3, 2) == Approx(1 + 18 * 1.3));
  CHECK(spline.at(1.3, 3) == Approx(18));
  CHECK(spline.at(1.3, 4) == 0);
}

TEST_CASE("spline and table in expressions equal the curves, whatever their ordinates are", "[curve][expression]") {
  const double p = 0.7;
  const std::vector<double> y{2, p, -1, 3 * p};
  const Curve spline(Interpolation::spline, kX, y), linear(Interpolation::linear, kX, y);
  for (const double x : {-1.5, -0.3, 0.0, 0.4, 1.9, 2.4}) {
    CHECK(value_of("spline(x, [-1, 0, 0.5, 2], [2, p, -1, 3*p])", x, p) == Approx(spline.at(x)).margin(1e-13));
    CHECK(value_of("table(x, [-1, 0, 0.5, 2], [2, p, -1, 3*p])", x, p) == Approx(linear.at(x)).margin(1e-13));
    CHECK(value_of("spline(x, [-1, 0, 0.5, 2], [2, 0.7, -1, 2.1])", x) == Approx(spline.at(x)).margin(1e-13));
  }
  CHECK(Expression::parse("2*table(0.25, [0, 0.5], [1, 3])").number() == 4);
  CHECK(value_of("table(x, [0 [mm], 500 [mm]], [0, 1])", 0.25) == Approx(0.5));
}

// Second-order differences of smooth functions of order one at a step of 1e-4: 1e-8.
TEST_CASE("derivatives of spline(x, ..) in x and in its ordinates are exact", "[curve][expression]") {
  Symbols symbols;
  symbols.add_input("x"), symbols.add_input("p");
  const Program f(Expression::parse("sin(spline(x*p, [-1, 0, 0.5, 2], [2, p, -p^2, 3]))"), symbols);
  const Program f_x = f.derivative(0), f_xx = f_x.derivative(0);
  Program::Scratch scratch = f_xx.scratch();
  f.grow(scratch), f_x.grow(scratch);
  const std::vector<double> at{0.9, 0.8};
  std::vector<double> gradient(2, 0.0), slope(2, 0.0), both(2, 0.0);
  f.add_gradient(at, 1, gradient, scratch);
  f.add_gradient_tangent(at, std::vector{1.0, 0.0}, 1, both, slope, scratch);
  constexpr double h = 1e-4;
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<double> up = at, down = at;
    up[k] += h, down[k] -= h;
    CHECK(gradient[k] == Approx((f.value(up, scratch) - f.value(down, scratch)) / (2 * h)).epsilon(1e-6));
    CHECK(slope[k] == Approx((f_x.value(up, scratch) - f_x.value(down, scratch)) / (2 * h)).epsilon(1e-6));
  }
  CHECK(f_x.value(at, scratch) == Approx(gradient[0]));
  CHECK(f_xx.value(at, scratch) == Approx(slope[0]));
}

TEST_CASE("misuse of spline and table is said in words", "[curve][expression]") {
  CHECK_THAT(error_of("spline(x, [0, 1], [1, 2, 3])"), Contains("2 abscissae and 3 ordinates"));
  CHECK_THAT(error_of("table(x, [1, 0], [1, 2])"), Contains("must increase"));
  CHECK_THAT(error_of("table(x, [0, p], [1, 2])"), Contains("'p' is a name; the abscissae"));
  CHECK_THAT(error_of("table(x, 0, 1)"), Contains("is written table(x, [x0, x1, ...], [y0, y1, ...])"));
  CHECK_THAT(error_of("table(x, [0], [1])"), Contains("two or more"));
  CHECK_THAT(error_of("1 + spline"), Contains("needs arguments"));
}

TEST_CASE("a spline reproduces a cubic everywhere, its derivatives too", "[spline]") {
  auto f = [](double t) { return 1 + t * (2 + t * (-3 + 0.5 * t)); };
  auto f_t = [](double t) { return 2 + t * (-6 + 1.5 * t); };
  auto f_tt = [](double t) { return -6 + 3 * t; };
  std::vector<double> times{0, 0.3, 0.7, 1.1, 2, 2.4}, values;
  for (const double t : times) values.push_back(f(t));
  const Curve spline = spline_through(times, values);
  for (double t = -0.2; t < 2.7; t += 0.05) {
    CHECK(spline.at(t) == Approx(f(t)).margin(1e-13));
    CHECK(spline.at(t, 1) == Approx(f_t(t)).margin(1e-12));
    CHECK(spline.at(t, 2) == Approx(f_tt(t)).margin(1e-11));
  }
}

TEST_CASE("two samples give a line, three a parabola", "[spline]") {
  CHECK(spline_through({0, 2}, {1, 5}).at(0.5) == Approx(2));
  const Curve parabola = spline_through({0, 1, 3}, {0, 1, 9});
  for (const double t : {0.2, 0.9, 1.7, 2.9}) {
    CHECK(parabola.at(t) == Approx(t * t).margin(1e-14));
    CHECK(parabola.at(t, 2) == Approx(2).margin(1e-13));
  }
}

TEST_CASE("a spline is twice continuously differentiable and converges at order 4", "[spline]") {
  auto error = [](int n) {
    std::vector<double> times, values;
    for (int i = 0; i <= n; ++i) times.push_back(3.0 * i / n), values.push_back(std::sin(times.back()));
    const Curve spline = spline_through(times, values);
    double worst = 0;
    for (int i = 0; i < 4000; ++i) worst = std::max(worst, std::abs(spline.at(7.4e-4 * i) - std::sin(7.4e-4 * i)));
    for (std::size_t i = 1; i + 1 < times.size(); ++i) {
      const double e = 1e-9;
      CHECK(spline.at(times[i] - e, 2) == Approx(spline.at(times[i] + e, 2)).margin(1e-6));
    }
    return worst;
  };
  CHECK(std::log2(error(80) / error(160)) == Approx(4).margin(0.2));
}

TEST_CASE("a spline refuses times that do not increase", "[spline]") {
  CHECK_THROWS_AS(spline_through({0, 1, 1}, {0, 1, 2}), std::invalid_argument);
  CHECK_THROWS_AS(spline_through({0}, {0}), std::invalid_argument);
}

TEST_CASE("a spline's slopes do not depend on the unit of time, and one beyond all numbers is refused", "[spline]") {
  const std::vector<double> values{0, 1, 0.5, 2, 1};
  const auto spline = [&](double unit) { return spline_through({0, unit, 1.5 * unit, 3 * unit, 4 * unit}, values); };
  const double slope = spline(1).at(2, 1);
  for (const double unit : {1e-100, 1e-12, 1e12, 1e156}) {
    INFO(unit);
    CHECK(spline(unit).at(2 * unit, 1) * unit == Approx(slope).epsilon(1e-12));
  }
  CHECK_THROWS_AS(spline(1e-162), std::invalid_argument);
  CHECK_THROWS_AS(spline_through({0, 1, 2, 3, 4}, {0, 1e308, -1e308, 1e308, 0}), std::invalid_argument);
}

TEST_CASE("a spline's third derivative is continuous at the second and the last but one sample", "[spline]") {
  const std::vector<double> times{0, 0.1, 1.3, 1.7, 1.72, 4, 4.5}, values{1, -2, 0.5, 3, 3.1, -7, 2};
  const Curve spline = spline_through(times, values);
  const auto third = [&](std::size_t i) {  // in the piece from sample i
    const double h = times[i + 1] - times[i];
    return (spline.at(times[i] + 0.75 * h, 2) - spline.at(times[i] + 0.25 * h, 2)) / (0.5 * h);
  };
  CHECK(third(0) == Approx(third(1)).epsilon(1e-12));
  CHECK(third(5) == Approx(third(4)).epsilon(1e-12));
  for (std::size_t i = 1; i + 1 < times.size(); ++i) {
    const double before = std::nextafter(times[i], 0), after = times[i];
    CHECK(spline.at(before) == Approx(spline.at(after)).epsilon(1e-12));
    CHECK(spline.at(before, 1) == Approx(spline.at(after, 1)).epsilon(1e-12));
    CHECK(spline.at(before, 2) == Approx(spline.at(after, 2)).epsilon(1e-11));
  }
}
