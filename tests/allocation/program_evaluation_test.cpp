#include <catch2/catch.hpp>

#include "core/expression/program.hpp"
#include "tests/allocation/allocation_count.hpp"

using namespace mbsopt;

TEST_CASE("evaluating an expression and its derivatives allocates nothing", "[allocation]") {
  Symbols symbols;
  for (const char* name : {"l", "ldot", "k"}) symbols.add_input(name);
  const Program program(Expression::parse("k*(l - 1)^3 + smooth_abs(ldot)*atan2(l, k) + max(l, k)^1.5"), symbols);
  Program::Scratch scratch = program.scratch();
  const double x[] = {1.2, 0.3, 50}, direction[] = {1, 0, 2};
  double gradient[3] = {}, gradient_tangent[3] = {};
  const long before = allocation_count();
  const double value = program.value(x, scratch);
  const double again = program.add_gradient(x, 1, gradient, scratch);
  program.add_gradient_tangent(x, direction, 1, gradient, gradient_tangent, scratch);
  const long after = allocation_count();
  CHECK(after == before);
  CHECK(value == again);
}
