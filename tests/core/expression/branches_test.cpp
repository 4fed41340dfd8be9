#include "core/expression/branches.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/expression/program_switches.hpp"

using namespace mbsopt;

namespace {

Symbols names() {
  Symbols symbols;
  for (const char* name : {"p", "x", "t"}) symbols.add_input(name);
  return symbols;
}

double value(const Program& program, double p, double x, double t) {
  Program::Scratch scratch = program.scratch();
  const double inputs[] = {p, x, t};
  return program.value(inputs, scratch);
}

}  // namespace

TEST_CASE("a held branch goes on beyond its end, and agrees with the program before it", "[branches]") {
  struct Case {
    const char* program;
    const char* above;  // where the first decision is positive
    const char* below;
  };
  const Case cases[] = {
      {"max(x - p, 0)", "x - p", "0"},
      {"3*min(x, p)^2", "3*p^2", "3*x^2"},
      {"abs(x - p)*t", "(x - p)*t", "(p - x)*t"},
      {"sqrt((x - p)^2)", "x - p", "p - x"},
      {"abs(x)/x", "1", "-1"},
      {"x/abs(x)", "1", "-1"},
      {"max(x, 0)^1.5", "max(x, 0)^1.5", "0"},
      {"table(x, [-1, 0.5, 2], [0, 0, 6])", "4*(x - 0.5)", "0"},
  };
  for (const Case& c : cases) {
    INFO(c.program);
    const Symbols symbols = names();
    const Program program(Expression::parse(c.program), symbols);
    const std::vector<Branching> branchings = branchings_of(program, 1, 2);
    REQUIRE(branchings.size() == 1);
    const Program above = with_branches(program, branchings, std::vector<int>{1}),
                  below = with_branches(program, branchings, std::vector<int>{-1}),
                  free = with_branches(program, branchings, std::vector<int>{0});
    CHECK(above.code().size() <= program.code().size());
    for (const double x : {-0.7, 0.2, 0.6, 1.4}) {
      const double p = 0.3, t = 0.8;
      CHECK(value(above, p, x, t) == Approx(value(Program(Expression::parse(c.above), symbols), p, x, t)));
      CHECK(value(below, p, x, t) == Approx(value(Program(Expression::parse(c.below), symbols), p, x, t)));
      CHECK(value(free, p, x, t) == value(program, p, x, t));
      const bool is_above = value(branchings[0].decision, p, x, t) > 0;
      CHECK(value(is_above ? above : below, p, x, t) == Approx(value(program, p, x, t)));
    }
  }
}

TEST_CASE("a held quotient of a number by itself has a value at zero", "[branches]") {
  const Symbols symbols = names();
  for (const char* text :
       {"(abs(x)/x + 1)/2*p", "(p*abs(x)/x + p)/2", "(x/abs(x)*p + p)/2", "(-p*abs(x)/(-x) + p)/2"}) {
    INFO(text);
    const Program program(Expression::parse(text), symbols);
    const std::vector<Branching> branchings = branchings_of(program, 1, 2);
    CHECK(value(with_branches(program, branchings, std::vector<int>{1}), 4, 0, 0) == 4);
    CHECK(value(with_branches(program, branchings, std::vector<int>{-1}), 4, 0, 0) == 0);
  }
}

TEST_CASE("branches of parameters alone, of smooth functions and of dense tables are left as they are", "[branches]") {
  const Symbols symbols = names();
  for (const char* text : {"1/abs(x)", "sqrt(abs(x))", "max(p, 2)*x", "tanh(x)",
                           "spline(x, [0, 1, 2, 3], [0, 1, 0, 1])", "table(t, [0, 1, 2], [0, 1, 0])"})
    CHECK(branchings_of(Program(Expression::parse(text), symbols), 1, 2).empty());
}

TEST_CASE("powers and roots tell at which side their base begins", "[branches]") {
  const Symbols symbols = names();
  const auto first = [&](const char* text) {
    return branchings_of(Program(Expression::parse(text), symbols), 1, 2).front();
  };
  CHECK(first("max(x, 0)^1.5").root == 1.5);
  CHECK(first("max(x, 0)^1.5").rises == 1);
  CHECK(first("(-2*min(x, 0))^1.2").root == 1.2);
  CHECK(first("(-2*min(x, 0))^1.2").rises == -1);
  CHECK(std::isinf(first("max(x, 0)^2").root));
}
