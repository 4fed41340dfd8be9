#include "core/expression/program_switches.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;

TEST_CASE("a program's switches are what its value or its slope may jump with", "[expression]") {
  Symbols symbols;
  for (const char* name : {"x", "y"}) symbols.add_input(name);
  struct Case {
    const char* expression;
    std::vector<double> at_2_3;  // the switches at x = 2, y = 3
  };
  const std::vector<Case> cases{{"x*y + abs(x) + min(x, y)", {-1, 2}},
                                {"x^2 + y*y + sin(x)", {}},
                                {"table(x, [0, 1, 2.5, 4], [0, 1, 2.6, -3])", {-0.5, 1}},
                                {"tanh(x/3)", {2. / 3}},
                                {"abs(x - y)/(x - y)", {-1}},
                                {"x/sqrt(x^2)", {2, 2}},
                                {"x/2 + y/pi", {}},
                                {"x^3 + x^0.5", {}},
                                {"x^(-1)", {2}},
                                {"y^x", {3}},
                                {"atan2(y, x)", {2, 3}},
                                {"tan(x)", {std::cos(2.0)}},
                                {"1/(1/x + y)", {2, 3.5}}};
  for (const Case& c : cases) {
    const Program program(Expression::parse(c.expression), symbols);
    std::vector<double> found;
    const double at[] = {2, 3};
    for (const Program& s : switches_of(program)) {
      Program::Scratch scratch = s.scratch();
      found.push_back(s.value(at, scratch));
    }
    INFO(c.expression);
    REQUIRE(found.size() == c.at_2_3.size());
    std::sort(found.begin(), found.end());
    for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i] == Approx(c.at_2_3[i]));
  }
  const Program slope = Program(Expression::parse("max(0, x - y)^2"), symbols).derivative(0).derivative(0);
  REQUIRE(switches_of(slope).size() >= 1);  // a choice at x = y
}
