// Functions through samples, and the expressions that use them.
#include "core/expression/curve.hpp"

#include <catch2/catch.hpp>
#include <cmath>

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
