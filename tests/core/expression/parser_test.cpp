#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>

#include "core/expression/expression.hpp"
#include "core/expression/program.hpp"

using namespace mbsopt;

namespace {

double value_of(const std::string& text) { return Expression::parse(text).number(); }

// Offset of the error in a text that must not parse.
std::size_t error_at(const std::string& text) {
  try {
    Expression::parse(text);
  } catch (const ExpressionError& error) {
    CHECK(std::string(error.what()).size() > 5);
    return error.offset;
  }
  FAIL("'" << text << "' must not parse");
  return 0;
}

std::string message_of(const std::string& text) {
  try {
    Expression::parse(text);
  } catch (const ExpressionError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("precedence and associativity are those of the problem format", "[expression]") {
  CHECK(value_of("1 + 2*3") == 7);
  CHECK(value_of("-2^2") == -4);
  CHECK(value_of("(-2)^2") == 4);
  CHECK(value_of("2^3^2") == 512);
  CHECK(value_of("2^-3") == 0.125);
  CHECK(value_of("2^-1^2") == 0.5);
  CHECK(value_of("--2") == 2);
  CHECK(value_of("2 - -3") == 5);
  CHECK(value_of("2*-3") == -6);
  CHECK(value_of("+4") == 4);
  CHECK(value_of("8/4/2") == 1);
  CHECK(value_of("8 - 4 - 2") == 2);
  CHECK(value_of("2/3*3") == Approx(2).epsilon(1e-15));
  CHECK(value_of(" \t\n(1)\r") == 1);
}

TEST_CASE("numbers are read in every usual form", "[expression]") {
  CHECK(value_of("1e3") == 1000);
  CHECK(value_of("1.5E-2") == 0.015);
  CHECK(value_of(".5") == 0.5);
  CHECK(value_of("5.") == 5);
  CHECK(value_of("0.1") == 0.1);
  CHECK(value_of("1.7976931348623157e308") == 1.7976931348623157e308);
  CHECK(value_of("4.9e-324") == 4.9e-324);
  CHECK(value_of("pi") == std::numbers::pi);
}

TEST_CASE("functions have the values of the C library", "[expression]") {
  CHECK(value_of("sin(0.3)") == std::sin(0.3));
  CHECK(value_of("cos(0.3)") == std::cos(0.3));
  CHECK(value_of("tan(0.3)") == std::tan(0.3));
  CHECK(value_of("asin(0.3)") == std::asin(0.3));
  CHECK(value_of("acos(0.3)") == std::acos(0.3));
  CHECK(value_of("atan(0.3)") == std::atan(0.3));
  CHECK(value_of("atan2(-1, -2)") == std::atan2(-1, -2));
  CHECK(value_of("sinh(0.3)") == std::sinh(0.3));
  CHECK(value_of("cosh(0.3)") == std::cosh(0.3));
  CHECK(value_of("tanh(0.3)") == std::tanh(0.3));
  CHECK(value_of("exp(0.3)") == std::exp(0.3));
  CHECK(value_of("log(0.3)") == std::log(0.3));
  CHECK(value_of("sqrt(0.3)") == std::sqrt(0.3));
  CHECK(value_of("abs(-0.3)") == 0.3);
  CHECK(value_of("min(3, 1, 2)") == 1);
  CHECK(value_of("max(3, 1, 4, 2)") == 4);
  CHECK(value_of("smooth_abs(3, 4)") == 5);
  CHECK(value_of("smooth_abs(0)") == 1e-6);
  CHECK(value_of("smooth_max(1, 4, 4)") == 5);
  CHECK(value_of("smooth_max(1, 2)") == Approx(2 + 2.5e-13).epsilon(1e-15));
  CHECK(value_of("smooth_abs(1e200, 1)") == 1e200);  // no overflow on the way
}

TEST_CASE("a number in brackets is converted to SI", "[expression]") {
  CHECK(value_of("4.2 [N/mm]") == Approx(4200).epsilon(1e-15));
  CHECK(value_of("90 [deg]") == Approx(std::numbers::pi / 2).epsilon(1e-15));
  CHECK(value_of("-3[cm]") == Approx(-0.03).epsilon(1e-15));
  CHECK(value_of("1 [m] + 3 [cm]") == Approx(1.03).epsilon(1e-15));
  CHECK(value_of("60 [rpm]") == Approx(2 * std::numbers::pi).epsilon(1e-15));
}

TEST_CASE("names are listed once and sorted", "[expression]") {
  const Expression e = Expression::parse("m*g*l/2 + m*sin(theta_0) + pi");
  CHECK(e.names() == std::vector<std::string>{"g", "l", "m", "theta_0"});
  CHECK(e.depends_on("g"));
  CHECK_FALSE(e.depends_on("theta"));
  CHECK_FALSE(e.is_number());
  CHECK(e.text() == "m*g*l/2 + m*sin(theta_0) + pi");
  CHECK(Expression(0.1).text() == "0.1");
  CHECK(Expression(0.1).is_number());
}

TEST_CASE("what is not an expression is refused where it goes wrong", "[expression]") {
  CHECK(error_at("") == 0);
  CHECK(error_at("   ") == 0);
  CHECK(error_at("1 +") == 3);
  CHECK(error_at("1 + * 2") == 4);
  CHECK(error_at("2 x") == 2);
  CHECK(error_at("2x") == 1);
  CHECK(error_at("1.2.3") == 3);
  CHECK(error_at("1e") == 1);
  CHECK(error_at("(1 + 2") == 0);
  CHECK(error_at("1 + 2)") == 5);
  CHECK(error_at("((1)") == 0);
  CHECK(error_at("sin") == 0);
  CHECK(error_at("1 + sin()") == 4);
  CHECK(error_at("sin(1, 2)") == 0);
  CHECK(error_at("min(1)") == 0);
  CHECK(error_at("atan2(1 2)") == 8);
  CHECK(error_at("atan2(1, ") == 9);
  CHECK(error_at("smooth_abs(1,2,3)") == 0);
  CHECK(error_at("1 [furlong]") == 3);
  CHECK(error_at("1 [m") == 2);
  CHECK(error_at("L1 [m]") == 3);
  CHECK(error_at("(1 + 2) [m]") == 8);
  CHECK(error_at("1 $ 2") == 2);
  CHECK(error_at("2 ** 3") == 2);
  CHECK(error_at("a = b") == 2);
  CHECK(error_at("a.b") == 1);
  CHECK(error_at("2 \xE2\x88\x92 1") == 2);  // a typographic minus
  CHECK(error_at(std::string("1\0+2", 4)) == 1);
}

TEST_CASE("numbers that are not finite are refused", "[expression]") {
  CHECK(error_at("1e400") == 0);
  CHECK(error_at("2 + 1e-400") == 4);
  CHECK(error_at("nan") == 0);
  CHECK(error_at("1 + NaN") == 4);
  CHECK(error_at("-inf") == 1);
  CHECK(error_at("Infinity") == 0);
  CHECK(message_of("1e400").find("range of double") != std::string::npos);
}

TEST_CASE("a misspelt function is answered with the nearest one", "[expression]") {
  CHECK(message_of("sinn(1)").find("did you mean 'sin'") != std::string::npos);
  CHECK(message_of("sqr(2)").find("did you mean 'sqrt'") != std::string::npos);
  CHECK(message_of("frobnicate(2)").find("available: sin, cos") != std::string::npos);
}

TEST_CASE("nesting too deep is an error, not a crash", "[expression]") {
  const std::string many = std::string(10000, '(') + "1" + std::string(10000, ')');
  CHECK(message_of(many).find("nests deeper") != std::string::npos);
  CHECK(message_of(std::string(100000, '-') + "1").find("nests deeper") != std::string::npos);
  std::string tower = "2", calls;
  for (int i = 0; i < 10000; ++i) tower += "^1", calls += "sin(";
  CHECK(message_of(tower).find("nests deeper") != std::string::npos);
  CHECK(message_of(calls).find("nests deeper") != std::string::npos);
  CHECK(value_of(std::string(90, '(') + "1" + std::string(90, ')')) == 1);
}

TEST_CASE("an expression of any length is read and released", "[expression]") {
  std::string text = "x";
  for (int i = 0; i < 200000; ++i) text += "+1";
  const Expression e = Expression::parse(text);
  Symbols symbols;
  symbols.add_input("x");
  const Program program(e, symbols);
  Program::Scratch scratch = program.scratch();
  const double x[] = {1.0};
  double gradient[] = {0.0};
  CHECK(program.add_gradient(x, 1, gradient, scratch) == 200001);
  CHECK(gradient[0] == 1);
}
