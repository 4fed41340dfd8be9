// Expressions: what parses is evaluated and differentiated twice; every sweep finds the same value.
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "core/expression/dimension_inference.hpp"
#include "core/expression/program.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using namespace mbsopt;
using fuzz::expect;

namespace {

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void evaluate(const Program& program, std::size_t inputs, std::string_view text) {
  Program::Scratch scratch = program.scratch();
  for (const double at : {0.0, 1.0, -0.7, 1e-300, 1e300}) {
    std::vector<double> x(inputs), direction(inputs, 1.0), g(inputs, 0.0), h(inputs, 0.0), tangent(inputs, 0.0);
    for (std::size_t i = 0; i < inputs; ++i) x[i] = at * (1 + 0.25 * static_cast<double>(i));
    const double value = program.value(x, scratch);
    expect(same(value, program.add_gradient(x, 1, g, scratch)), "another value beside the gradient", text);
    program.add_gradient_tangent(x, direction, 1, h, tangent, scratch);
    for (std::size_t i = 0; i < inputs; ++i) {
      expect(same(g[i], h[i]), "another gradient beside its tangent", text);
      if (!program.uses(static_cast<int>(i))) expect(g[i] == 0, "a derivative in an input that is not used", text);
    }
  }
}

void infer(const Expression& expression) {
  const auto dimension_of = [](const std::string& name) -> std::optional<Dimension> {
    if (name == "t") return dimension::kTime;
    if (name == "m") return dimension::kMass;
    if (name.starts_with('L')) return dimension::kLength;
    return std::nullopt;
  };
  try {
    if (const std::optional<Dimension> found = infer_dimension(expression, dimension_of)) to_string(*found);
  } catch (const DimensionError& error) {
    fuzz::expect_words(error.what(), expression.text());
    expect(error.offset <= expression.text().size(), "an offset outside of the text", error.what());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  parse_unit(text);
  Expression expression;
  try {
    expression = Expression::parse(text);
  } catch (const ExpressionError& error) {
    fuzz::expect_words(error.what(), text);
    expect(error.offset <= size, "an offset outside of the text", error.what());
    return 0;
  }
  infer(expression);
  const Expression again = Expression::parse(expression.text());
  expect(again.names() == expression.names(), "the text reads back with other names", text);
  expect(again.is_number() == expression.is_number(), "the text reads back as another kind", text);
  if (expression.is_number()) expect(same(again.number(), expression.number()), "the text reads back otherwise", text);
  Symbols symbols;
  for (const std::string& name : expression.names()) symbols.add_input(name);
  const Program program(expression, symbols);
  const std::size_t inputs = expression.names().size();
  evaluate(program, inputs, text);
  if (inputs > 0 && size < 200) {  // a derivative is several times as long
    const Program derivative = program.derivative(0);
    evaluate(derivative, inputs, text);
    evaluate(derivative.derivative(static_cast<int>(inputs) - 1), inputs, text);
  }
  return 0;
}
