#include "core/expression/time_parts.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/expression/program_range.hpp"

using namespace mbsopt;

namespace {

Program program_of(const std::string& text) {
  Symbols symbols;
  for (const char* name : {"p", "x", "t"}) symbols.add_input(name);
  symbols.add_definition("logged",
                         Expression::of_curve(std::make_shared<Curve>(Interpolation::linear, std::vector<double>{0, 20},
                                                                      std::vector<double>{1, 2}),
                                              Expression::parse("t - p"), "logged"));
  return Program(Expression::parse(text), symbols);
}

// The integral over all pieces, by Gauss's rule of three points.
double integral(const Program& part, double end, double p) {
  const std::vector<double> t = pieces_of(part, 2, {p, 0, 0}, 0, end);
  Program::Scratch scratch = part.scratch();
  double sum = 0;
  for (std::size_t i = 1; i < t.size(); ++i) {
    const double h = t[i] - t[i - 1], middle = 0.5 * (t[i] + t[i - 1]), node = std::sqrt(0.15) * h;
    const auto f = [&](double at) { return part.value(std::vector<double>{p, 0, at}, scratch); };
    sum += h / 18 * (5 * f(middle - node) + 8 * f(middle) + 5 * f(middle + node));
  }
  return sum;
}

}  // namespace

TEST_CASE("pieces resolve pulses, steps and kinks of time at any instant and width", "[expression]") {
  struct Case {
    const char* text;
    double end, integral;
  };
  const double root_pi = std::sqrt(std::numbers::pi);
  const auto [text, end, exact] = GENERATE_COPY(values<Case>({
      {"x*max(0, 1 - abs(t - 3.37)/1e-5)", 10, 1e-5},
      {"300*t + 70*max(0, 1 - abs(t - 7.3)/0.0002)", 10, 15000 + 0.014},
      {"p*exp(-((t - 0.50337)/0.0003)^2)", 20, 3e-4 * root_pi},
      {"0.5*(1 + tanh((t - 4)/1e-4))", 8, 4},
      {"1/(1 + exp(-(t - 7.7777)/1e-5))", 20, 12.2223},
      {"x/(1 + ((t - 3.3)/1e-4)^2)", 6.6, 2e-4 * std::atan(33000)},
      {"smooth_max(0, 1 - abs(t - 7.123)/1e-3, 1e-6)", 10, 1e-3},
      {"smooth_max(0, sin(t) - 0.9999, 1e-9)", 3, std::sqrt(2e-4) * 4e-4 / 3},
      {"x*sin(50*t)", 10, (1 - std::cos(500.0)) / 50},
      {"x*(t*sin(19*t))", 10, std::sin(190.0) / 361 - 10 * std::cos(190.0) / 19},
      {"abs(t - 2.9)/(t - 2.9)", 10, 4.2},
  }));
  CAPTURE(text);
  const std::vector<Program> parts = time_parts_of(program_of(text), 1, 2);
  REQUIRE(parts.size() == 1);
  CHECK(integral(parts[0], end, 1) == Approx(exact).epsilon(1e-4));
  CHECK(pieces_of(parts[0], 2, {1, 0, 0}, 0, end).size() < 1500);
}

TEST_CASE("parts of time leave out the motion, straight lines and known samples", "[expression]") {
  const auto parts = [](const char* text) { return time_parts_of(program_of(text), 1, 2).size(); };
  CHECK(parts("x*sin(t) + exp(p*t)") == 2);
  CHECK(parts("x*(2*p*t - 1)/p") == 0);
  CHECK(parts("logged*x") == 0);
  CHECK(parts("logged*max(0, t - 1)*x") == 1);
  CHECK(parts("sin(x + t)") == 0);
}

TEST_CASE("ranges hold every value between their inputs", "[expression]") {
  const char* text = GENERATE("x*t - t^3", "sin(3*x) + cos(t)", "t/(2 + x^2)", "abs(x) + max(t, x) - min(t, 0.2)",
                              "tanh(5*x) + exp(t) + atan2(t, 2 + x)", "smooth_abs(x, 0.1)*cosh(t) - sqrt(1 + x^4)",
                              "logged + tan(0.3*t)", "1/x + 2^t");
  CAPTURE(text);
  const Program p = program_of(text);
  Program::Scratch scratch = p.scratch();
  std::vector<Range> range;
  for (double low = -2; low < 2; low += 0.37) {
    const Range of_x{low, low + 0.9, false}, of_t{-low - 0.3, 1 - low, false};
    ranges_of(p, std::vector<Range>{{1, 1, false}, of_x, of_t}, range);
    for (int i = 0; i <= 20; ++i)
      for (int j = 0; j <= 20; ++j) {
        const double x = of_x.low + 0.045 * i, t = of_t.low + 0.065 * j;
        const double f = p.value(std::vector<double>{1, x, t}, scratch);
        CHECK((std::isnan(f) || (f >= range.back().low - 1e-12 && f <= range.back().high + 1e-12)));
      }
  }
}
