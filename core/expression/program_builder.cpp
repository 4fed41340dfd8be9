#include "core/expression/program_builder.hpp"

namespace mbsopt {

Program::Program(const Expression& expression, const Symbols& symbols) {
  ProgramBuilder(symbols, *this).build(expression);
}

// Laws of motion need f, f_t and f_tt with the parameters' derivatives of all three. Two derivative programs and the
// reverse sweep of each give them exactly.
Program Program::derivative(int input) const {
  Program result;
  const Symbols none;
  ProgramBuilder(none, result).build_derivative(*this, input);
  return result;
}

void ProgramBuilder::build_derivative(const Program& of, int input) {
  const std::size_t size = of.code_.size();
  std::vector<int> at(size), d(size, -1);  // each instruction here, and its derivative; -1: zero
  const auto is_zero = [&](int x) { return x < 0 || is(x, 0); };
  for (std::size_t i = 0; i < size; ++i) {
    const Instruction& in = of.code_[i];
    if (operands(in.operation) == 0) {
      at[i] = copied(of, in, -1, -1);
      if (in.operation == Operation::name && in.a == input) d[i] = number(1);
      continue;
    }
    const std::size_t ia = static_cast<std::size_t>(in.a), ib = in.b < 0 ? ia : static_cast<std::size_t>(in.b);
    at[i] = copied(of, in, at[ia], in.b < 0 ? -1 : at[ib]);
    const bool of_a = !is_zero(d[ia]), of_b = in.b >= 0 && !is_zero(d[ib]);
    if (!of_a && !of_b) continue;
    if (in.operation == Operation::curve) {
      const auto& [f, order] = of.curve_of(in);
      d[i] = operation(Operation::multiply, curve({f, order + 1}, at[ia]), d[ia]);
      continue;
    }
    const Partials<Term> f = partials(in.operation, Term(this, at[ia]), Term(this, at[ib]), Term(this, at[i]));
    const int by_a = of_a ? operation(Operation::multiply, f.a.at, d[ia]) : -1;
    const int by_b = of_b ? operation(Operation::multiply, f.b.at, d[ib]) : -1;
    d[i] = of_a && of_b ? operation(Operation::add, by_a, by_b) : of_a ? by_a : by_b;
  }
  keep_only_what_reaches(size == 0 || d.back() < 0 ? number(0) : d.back());
}

void ProgramBuilder::build_part(const Program& of, int a, Operation how, int b, double from) {
  std::vector<int> at(static_cast<std::size_t>(std::max(a, b)) + 1, -1);
  const auto operand = [&](int k) { return k < 0 ? -1 : at[static_cast<std::size_t>(k)]; };
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Instruction& in = of.code_[i];
    at[i] = in.operation == Operation::name ? copied(of, in, -1, -1) : copied(of, in, operand(in.a), operand(in.b));
  }
  const int first = at[static_cast<std::size_t>(a)];
  keep_only_what_reaches(how == Operation::cos        ? operation(how, first, -1)
                         : how == Operation::divide   ? operation(how, number(1), first)
                         : how == Operation::negate   ? negative(first)
                         : how == Operation::subtract ? operation(how, first, at[static_cast<std::size_t>(b)])
                         : how == Operation::number   ? operation(Operation::subtract, first, number(from))
                                                      : first);
}

}  // namespace mbsopt
