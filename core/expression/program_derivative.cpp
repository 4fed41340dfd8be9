// Derivative programs. Laws of motion need f, f_t and f_tt with the parameters' derivatives of all three. Two
// derivative programs and the reverse sweep of each give them exactly.
#include "core/expression/program_builder.hpp"

namespace mbsopt {

// Builds df/da (first) or df/db of one instruction. operands and value are instructions of this builder. Where no
// derivative exists, the rules of operation.hpp hold: abs' = sign, min and max take the operand in use.
int ProgramBuilder::partial(const Program& of, const Instruction& in, int a, int b, int value, bool first) {
  using Op = Operation;
  auto square = [&](int x) { return operation(Op::multiply, x, x); };
  auto inverse = [&](int x) { return operation(Op::divide, number(1), x); };
  switch (in.operation) {
    case Operation::number:
    case Operation::name:
    case Operation::sign:
    case Operation::not_above:
      break;
    case Operation::curve: {
      const auto& [f, order] = of.curve_of(in);
      return curve({f, order + 1}, a);
    }
    case Operation::negate:
      return number(-1);
    case Operation::add:
      return number(1);
    case Operation::subtract:
      return number(first ? 1 : -1);
    case Operation::multiply:
      return first ? b : a;
    case Operation::divide:
      return first ? inverse(b) : operation(Op::negate, operation(Op::divide, value, b), -1);
    case Operation::power:
      if (first) return operation(Op::multiply, b, operation(Op::power, a, operation(Op::subtract, b, number(1))));
      return operation(Op::multiply, value, operation(Op::log, a, -1));
    case Operation::sin:
      return operation(Op::cos, a, -1);
    case Operation::cos:
      return operation(Op::negate, operation(Op::sin, a, -1), -1);
    case Operation::tan:
      return operation(Operation::add, number(1), square(value));
    case Operation::asin:
    case Operation::acos: {
      const int slope = inverse(operation(Op::sqrt, operation(Op::subtract, number(1), square(a)), -1));
      return in.operation == Operation::asin ? slope : operation(Op::negate, slope, -1);
    }
    case Operation::atan:
      return inverse(operation(Operation::add, number(1), square(a)));
    case Operation::atan2: {
      const int r2 = operation(Operation::add, square(a), square(b));
      return first ? operation(Op::divide, b, r2) : operation(Op::negate, operation(Op::divide, a, r2), -1);
    }
    case Operation::sinh:
      return operation(Op::cosh, a, -1);
    case Operation::cosh:
      return operation(Op::sinh, a, -1);
    case Operation::tanh:
      return operation(Op::subtract, number(1), square(value));
    case Operation::exp:
      return value;
    case Operation::log:
      return inverse(a);
    case Operation::sqrt:
      return operation(Op::divide, number(0.5), value);
    case Operation::abs:
      return operation(Op::sign, a, -1);
    case Operation::min:
    case Operation::max: {
      const int uses_a =
          in.operation == Operation::min ? operation(Op::not_above, a, b) : operation(Op::not_above, b, a);
      return first ? uses_a : operation(Op::subtract, number(1), uses_a);
    }
    case Operation::smooth_abs:
      return operation(Op::divide, first ? a : b, value);
  }
  return number(0);
}

void ProgramBuilder::build_derivative(const Program& of, int input) {
  const std::size_t size = of.code_.size();
  std::vector<int> at(size), d(size, -1);  // each instruction here, and its derivative; -1: zero
  auto is_zero = [&](int x) { return x < 0 || is(x, 0); };
  for (std::size_t i = 0; i < size; ++i) {
    const Instruction& in = of.code_[i];
    if (operands(in.operation) == 0) {
      at[i] = copied(of, in, -1, -1);
      if (in.operation == Operation::name && in.a == input) d[i] = number(1);
    } else {
      const std::size_t ia = static_cast<std::size_t>(in.a), ib = static_cast<std::size_t>(std::max(in.b, 0));
      const int a = at[ia], b = in.b < 0 ? -1 : at[ib];
      at[i] = copied(of, in, a, b);
      int sum = -1;
      if (!is_zero(d[ia])) sum = operation(Operation::multiply, partial(of, in, a, b, at[i], true), d[ia]);
      if (in.b >= 0 && !is_zero(d[ib])) {
        const int term = operation(Operation::multiply, partial(of, in, a, b, at[i], false), d[ib]);
        sum = sum < 0 ? term : operation(Operation::add, sum, term);
      }
      d[i] = sum;
    }
  }
  keep_only_what_reaches(size == 0 || d.back() < 0 ? number(0) : d.back());
}

Program Program::derivative(int input) const {
  Program result;
  const Symbols none;
  ProgramBuilder(none, result).build_derivative(*this, input);
  return result;
}

}  // namespace mbsopt
