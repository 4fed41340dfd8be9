#include "core/expression/program.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <random>

#include "core/expression/syntax_tree.hpp"

using namespace mbsopt;

namespace {

using ComplexStep = std::complex<double>;

// An evaluator of its own, over the syntax tree and the complex numbers: its imaginary part at x + ih is h df/dx
// without any cancellation.
ComplexStep evaluate(const Expression& expression, const std::vector<std::string>& names,
                     const std::vector<ComplexStep>& x) {
  std::vector<ComplexStep> v;
  for (const SyntaxNode& node : expression.tree().nodes) {
    const ComplexStep a = node.a < 0 ? 0 : v[static_cast<std::size_t>(node.a)];
    const ComplexStep b = node.b < 0 ? 0 : v[static_cast<std::size_t>(node.b)];
    switch (node.operation) {
      case Operation::number:
        v.push_back(node.value);
        break;
      case Operation::name:
        v.push_back(x[static_cast<std::size_t>(std::find(names.begin(), names.end(), node.name) - names.begin())]);
        break;
      case Operation::negate:
        v.push_back(-a);
        break;
      case Operation::add:
        v.push_back(a + b);
        break;
      case Operation::subtract:
        v.push_back(a - b);
        break;
      case Operation::multiply:
        v.push_back(a * b);
        break;
      case Operation::divide:
        v.push_back(a / b);
        break;
      case Operation::power:
        v.push_back(std::pow(a, b));
        break;
      case Operation::sin:
        v.push_back(std::sin(a));
        break;
      case Operation::cos:
        v.push_back(std::cos(a));
        break;
      case Operation::tan:
        v.push_back(std::tan(a));
        break;
      case Operation::asin:
        v.push_back(std::asin(a));
        break;
      case Operation::acos:
        v.push_back(std::acos(a));
        break;
      case Operation::atan:
        v.push_back(std::atan(a));
        break;
      case Operation::atan2:
        v.push_back(2.0 * std::atan(a / (std::sqrt(a * a + b * b) + b)));
        break;  // b > 0
      case Operation::sinh:
        v.push_back(std::sinh(a));
        break;
      case Operation::cosh:
        v.push_back(std::cosh(a));
        break;
      case Operation::tanh:
        v.push_back(std::tanh(a));
        break;
      case Operation::exp:
        v.push_back(std::exp(a));
        break;
      case Operation::log:
        v.push_back(std::log(a));
        break;
      case Operation::sqrt:
        v.push_back(std::sqrt(a));
        break;
      case Operation::abs:
        v.push_back(a.real() < 0 ? -a : a);
        break;
      case Operation::min:
        v.push_back(a.real() <= b.real() ? a : b);
        break;
      case Operation::max:
        v.push_back(a.real() >= b.real() ? a : b);
        break;
      case Operation::smooth_abs:
        v.push_back(std::sqrt(a * a + b * b));
        break;
      case Operation::curve:
        v.emplace_back(node.curve->at(a.real()), a.imag() * node.curve->at(a.real(), 1));
        break;
      case Operation::sign:
      case Operation::not_above:
        FAIL("only derivative programs have these");
    }
  }
  return v.back();
}

const std::vector<std::string> kNames{"x", "y", "z"};

Symbols xyz() {
  Symbols symbols;
  for (const std::string& name : kNames) symbols.add_input(name);
  return symbols;
}

struct Derivatives {
  double value = 0, value_tangent = 0;
  std::vector<double> gradient = {0, 0, 0}, gradient_tangent = {0, 0, 0};
};

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

Derivatives derivatives(const std::string& text, const std::vector<double>& x, const std::vector<double>& tangent) {
  const Program program(Expression::parse(text), xyz());
  Program::Scratch scratch = program.scratch();
  Derivatives d;
  d.value = program.value(x, scratch);
  d.value_tangent = program.add_gradient_tangent(x, tangent, 1, d.gradient, d.gradient_tangent, scratch);
  std::vector<double> reverse(3, 0.0);
  CHECK(same(program.add_gradient(x, 1, reverse, scratch), d.value));
  for (std::size_t k = 0; k < 3; ++k) CHECK(same(reverse[k], d.gradient[k]));
  return d;
}

double gradient_x(const std::string& text, double x) { return derivatives(text, {x, 1, 1}, {1, 0, 0}).gradient[0]; }
double second_xx(const std::string& text, double x) {
  return derivatives(text, {x, 1, 1}, {1, 0, 0}).gradient_tangent[0];
}

const char* const kSamples[] = {
    "x*y*z + x/y - z",
    "x^2 + y^3 + z^-2",
    "x^y + y^z",
    "sin(x*y)*cos(z)",
    "tan(x/2) + asin(x/4) - acos(y/4)",
    "atan(x*y) + atan2(x, y) + atan2(x*y, z+y)",
    "sinh(x) + cosh(y) - tanh(x*z)",
    "exp(-x^2)*log(y+z)",
    "sqrt(x^2 + y^2 + z^2)",
    "abs(x - 3*y) + min(x, y) + max(y, z, x)",
    "smooth_abs(x - y, 0.1) + smooth_abs(z - x)",
    "smooth_max(x, y, 0.2)*smooth_max(z, x*y)",
    "(x + y)^2/(x + y) - (x + y)*(y + x)",
    "x^1.5 + y^0.5 + 2^z",
    "-x^2 - -y",
    "((x*y + z)*x + y)*z",
    "pi*x/(1 [cm] + y) + 2^-3^x",
};

}  // namespace

TEST_CASE("gradients equal the complex step, second derivatives central differences of gradients", "[expression]") {
  const std::string text = GENERATE(from_range(std::begin(kSamples), std::end(kSamples)));
  CAPTURE(text);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.3, 1.9), direction(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<double> x{uniform(random), uniform(random), uniform(random)};
    const std::vector<double> u{direction(random), direction(random), direction(random)};
    const Derivatives d = derivatives(text, x, u);
    const Expression expression = Expression::parse(text);
    CHECK(d.value == Approx(evaluate(expression, kNames, {x[0], x[1], x[2]}).real()).epsilon(1e-13));
    double along = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<ComplexStep> z{x[0], x[1], x[2]};
      z[k] += ComplexStep(0, 1e-100);
      CHECK(d.gradient[k] == Approx(evaluate(expression, kNames, z).imag() * 1e100).epsilon(1e-12).margin(1e-13));
      along += d.gradient[k] * u[k];
    }
    CHECK(d.value_tangent == Approx(along).epsilon(1e-12).margin(1e-13));
    const double h = 1e-5;
    std::vector<double> ahead = x, behind = x;
    for (std::size_t k = 0; k < 3; ++k) ahead[k] += h * u[k], behind[k] -= h * u[k];
    const Derivatives plus = derivatives(text, ahead, u), minus = derivatives(text, behind, u);
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(d.gradient_tangent[k] ==
            Approx((plus.gradient[k] - minus.gradient[k]) / (2 * h)).epsilon(1e-7).margin(1e-7));
  }
}

TEST_CASE("closed forms of second derivatives", "[expression]") {
  const Derivatives d = derivatives("x^3*y^2*z", {2, 3, 5}, {1, 1, 1});
  CHECK(d.value == 360);
  CHECK(d.gradient == std::vector<double>{540, 240, 72});  // 3x^2 y^2 z, 2 x^3 y z, x^3 y^2
  CHECK(d.gradient_tangent == std::vector<double>{540 + 360 + 108, 360 + 80 + 48, 108 + 48});
}

TEST_CASE("derivatives are exact at awkward points", "[expression]") {
  CHECK(gradient_x("x^0", 0) == 0);
  CHECK(gradient_x("x^1", 0) == 1);
  CHECK(gradient_x("x^2", 0) == 0);
  CHECK(second_xx("x^2", 0) == 2);
  CHECK(gradient_x("x^3", 0) == 0);
  CHECK(second_xx("x^3", 0) == 0);
  CHECK(gradient_x("x^3", -2) == 12);
  CHECK(second_xx("x^3", -2) == -12);
  CHECK(gradient_x("x^-1", -2) == -0.25);
  CHECK(gradient_x("x^1.5", 0) == 0);
  CHECK(std::isinf(second_xx("x^1.5", 0)));
  CHECK(gradient_x("sqrt(x)", 0) == std::numeric_limits<double>::infinity());
  CHECK(gradient_x("abs(x)", 0) == 0);
  CHECK(gradient_x("smooth_abs(x, 0)", 0) == 0);
  CHECK(second_xx("smooth_abs(x, 0.5)", 0) == 2);
  CHECK(gradient_x("(0*y)^2 + x", 3) == 1);
  CHECK(gradient_x("max(x, x)", 3) == 1);
  // a variable exponent of value 0 and 2
  const Derivatives zero = derivatives("x^y", {0, 0, 1}, {1, 0, 0});
  CHECK(zero.gradient[0] == 0);
  const Derivatives two = derivatives("x^y", {0, 2, 1}, {1, 0, 0});
  CHECK(two.value == 0);
  CHECK(two.gradient[0] == 0);
  CHECK(two.gradient[1] == 0);
  CHECK(two.gradient_tangent[0] == 2);
  CHECK(two.gradient_tangent[1] == 0);
  const Derivatives negative = derivatives("x^y", {-3, 2, 1}, {1, 0, 0});
  CHECK(negative.gradient[0] == -6);
}

TEST_CASE("atan2 has its derivatives on the axes and for tiny arguments", "[expression]") {
  const struct {
    double y, x, dy, dx;
  } cases[] = {{0, 2, 0.5, 0},  {0, -2, -0.5, 0},       {2, 0, 0, -0.5},
               {-2, 0, 0, 0.5}, {1e-200, 0, 0, -1e200}, {0, 1e200, 1e-200, 0}};
  for (const auto& c : cases) {
    const Derivatives d = derivatives("atan2(x, y)", {c.y, c.x, 0}, {0, 0, 0});
    CHECK(d.value == std::atan2(c.y, c.x));
    CHECK(d.gradient[0] == Approx(c.dy).epsilon(1e-15));
    CHECK(d.gradient[1] == Approx(c.dx).epsilon(1e-15));
  }
}

TEST_CASE("an infinite derivative off the path of the result does not disturb the gradient", "[expression]") {
  const Derivatives d = derivatives("min(sqrt(x), -1) + y", {0, 2, 0}, {1, 1, 0});
  CHECK(d.gradient == std::vector<double>{0, 1, 0});
  const Derivatives direction = derivatives("sqrt(x) + y^2", {0, 2, 0}, {0, 1, 0});
  CHECK(direction.value_tangent == 4);
  CHECK(direction.gradient_tangent[1] == 2);
}

TEST_CASE("NaN passes through min and max", "[expression]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const char* text : {"min(x, y)", "max(x, y)", "min(y, x)", "max(y, x)"})
    CHECK(std::isnan(derivatives(text, {nan, 1, 1}, {0, 0, 0}).value));
}

TEST_CASE("definitions are expanded, shared and may be given in any order", "[expression]") {
  Symbols symbols;
  symbols.add_definition("area", Expression::parse("w*h"));
  symbols.add_definition("h", Expression::parse("2*w"));
  symbols.add_input("w");
  const Program program(Expression::parse("area^2 + area"), symbols);
  Program::Scratch scratch = program.scratch();
  const double x[] = {3.0};
  double gradient[] = {10.0};
  CHECK(program.add_gradient(x, 2.0, gradient, scratch) == 18 * 18 + 18);
  CHECK(gradient[0] == 10 + 2 * (2 * 18 + 1) * 12);  // d area/dw = 4 w
}

TEST_CASE("unknown and circular names are refused by name", "[expression]") {
  Symbols symbols;
  symbols.add_input("length");
  symbols.add_definition("a", Expression::parse("b + 1"));
  symbols.add_definition("b", Expression::parse("a + 1"));
  symbols.add_definition("self", Expression::parse("self"));
  try {
    Program(Expression::parse("lenght"), symbols);
    FAIL("must throw");
  } catch (const UnknownName& error) {
    CHECK(error.name == "lenght");
    CHECK(std::string(error.what()).find("did you mean 'length'") != std::string::npos);
  }
  CHECK_THROWS_AS(Program(Expression::parse("a"), symbols), UnknownName);
  CHECK_THROWS_AS(Program(Expression::parse("self"), symbols), UnknownName);
  CHECK_THROWS_AS(symbols.add_input("a"), std::invalid_argument);
  CHECK_THROWS_AS(symbols.add_definition("length", Expression()), std::invalid_argument);
}

TEST_CASE("a long chain of definitions is an error, not a crash", "[expression]") {
  Symbols symbols;
  symbols.add_input("d0");
  for (int i = 1; i < 20000; ++i)
    symbols.add_definition("d" + std::to_string(i), Expression::parse("d" + std::to_string(i - 1) + "+1"));
  CHECK_THROWS_AS(Program(Expression::parse("d19999"), symbols), UnknownName);
  const Program fine(Expression::parse("d400"), symbols);
  CHECK(fine.uses(0));
}

TEST_CASE("used inputs are structural", "[expression]") {
  const Symbols symbols = xyz();
  CHECK(Program(Expression::parse("2*pi"), symbols).is_constant());
  CHECK(Program(Expression::parse("0*x"), symbols).is_constant());
  CHECK(Program(Expression::parse("x^0"), symbols).is_constant());
  CHECK(Program(Expression::parse("z + 0*x"), symbols).used_inputs() == std::vector<int>{2});
  CHECK(Program(Expression::parse("z*x + x"), symbols).used_inputs() == std::vector<int>{0, 2});
  CHECK_FALSE(Program(Expression::parse("y"), symbols).uses(0));
  CHECK(Program().is_constant());
  Program::Scratch scratch;
  CHECK(Program().value({}, scratch) == 0);
}

TEST_CASE("one scratch serves several programs once it has grown", "[expression]") {
  const Symbols symbols = xyz();
  const Program small(Expression::parse("x"), symbols), large(Expression::parse("sin(x*y)+cos(y*z)"), symbols);
  Program::Scratch scratch = small.scratch();
  large.grow(scratch);
  const double x[] = {1, 2, 3};
  CHECK(large.value(x, scratch) == std::sin(2.0) + std::cos(6.0));
  CHECK(small.value(x, scratch) == 1);
}

TEST_CASE("a derivative program computes the derivative, and its own derivatives the higher ones", "[program]") {
  const char* text = GENERATE("x^3*y + sin(x*z)/y", "exp(-x/z)*cos(y*x)^2", "atan2(x*y, z + x^2) + log(x + 2*z)",
                              "sqrt(x*y + z)*tanh(x - y)", "abs(x - 3)*max(x, y, 0.1)*min(z, x*y)",
                              "asin(x/9)*acos(x/8) + atan(x*z)", "x^y + z^x + smooth_abs(x - y, 0.1)",
                              "sinh(x/2)*cosh(y*x/4) - tan(x/3)", "y + z", "7", "smooth_max(x, y, 0.2)*x");
  const Symbols symbols = xyz();
  const Expression expression = Expression::parse(text);
  const Program f(expression, symbols), f_x = f.derivative(0), f_xx = f_x.derivative(0);
  const std::vector<double> at{1.3, 0.8, 2.1};
  auto derivative = [&](std::size_t k, double h) {  // by the complex step, and of that by central differences
    std::vector<ComplexStep> x{at[0] + h, at[1], at[2]};
    x[k] += ComplexStep(0, 1e-40);
    return evaluate(expression, kNames, x).imag() / 1e-40;
  };
  Program::Scratch scratch;
  for (const Program* p : {&f, &f_x, &f_xx}) p->grow(scratch);
  INFO(text);
  CHECK(f_x.value(at, scratch) == Approx(derivative(0, 0)).epsilon(1e-12).margin(1e-13));
  const double h = 1e-3;
  auto slope = [&](std::size_t k, double d) { return (derivative(k, d) - derivative(k, -d)) / (2 * d); };
  const double second = (4 * slope(0, h / 2) - slope(0, h)) / 3;
  CHECK(f_xx.value(at, scratch) == Approx(second).epsilon(1e-9).margin(1e-9));
  // Its gradient: mixed derivatives, here by differences in x of those in y and z.
  std::vector<double> gradient(3, 0.0);
  f_x.add_gradient(at, 1, gradient, scratch);
  for (std::size_t k = 0; k < 3; ++k) {
    const double mixed = (4 * slope(k, h / 2) - slope(k, h)) / 3;
    CHECK(gradient[k] == Approx(mixed).epsilon(1e-9).margin(1e-9));
  }
}
