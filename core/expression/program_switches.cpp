#include "core/expression/program_switches.hpp"

#include <algorithm>
#include <set>
#include <tuple>

#include "core/expression/program_builder.hpp"

namespace mbsopt {

// how selects cos of a, 1/a (divide), a - b (subtract), or a itself (name).
void ProgramBuilder::build_switch(const Program& of, Operation how, int a, int b) {
  const std::size_t size = static_cast<std::size_t>(std::max(a, b)) + 1;
  std::vector<char> needed(size, 0);
  needed[static_cast<std::size_t>(a)] = 1;
  if (b >= 0) needed[static_cast<std::size_t>(b)] = 1;
  for (std::size_t i = size; i-- > 0;) {
    const Instruction& in = of.code_[i];
    if (!needed[i] || operands(in.operation) == 0) continue;
    needed[static_cast<std::size_t>(in.a)] = 1;
    if (in.b >= 0) needed[static_cast<std::size_t>(in.b)] = 1;
  }
  std::vector<int> at(size, -1);
  for (std::size_t i = 0; i < size; ++i) {
    if (!needed[i]) continue;
    const Instruction& in = of.code_[i];
    const auto operand = [&](int k) { return k < 0 ? -1 : at[static_cast<std::size_t>(k)]; };
    at[i] = operands(in.operation) == 0 ? copied(of, in, -1, -1) : copied(of, in, operand(in.a), operand(in.b));
  }
  const int first = at[static_cast<std::size_t>(a)];
  keep_only_what_reaches(how == Operation::cos        ? operation(how, first, -1)
                         : how == Operation::divide   ? operation(how, number(1), first)
                         : how == Operation::subtract ? operation(how, first, at[static_cast<std::size_t>(b)])
                                                      : first);
}

std::vector<Program> ProgramBuilder::switches_of(const Program& program) {
  std::set<std::tuple<Operation, int, int>> all;
  bool may_jump = false;
  for (const Instruction& in : program.code_) {
    const auto choice = [&](Operation how, int a, int b = -1) { all.insert({how, a, b}); };
    const auto jump = [&](Operation how, int a, int b = -1) { may_jump = true, choice(how, a, b); };
    switch (in.operation) {
      case Operation::divide:
        jump(Operation::name, in.b);
        break;
      case Operation::power: {
        const Instruction& exponent = program.code_[static_cast<std::size_t>(in.b)];
        const bool continuous = exponent.operation == Operation::number && exponent.constant >= 0;
        continuous ? choice(Operation::name, in.a) : jump(Operation::name, in.a);
        break;
      }
      case Operation::atan2:
        jump(Operation::name, in.a), jump(Operation::name, in.b);
        break;
      case Operation::tan:
        jump(Operation::cos, in.a);
        break;
      case Operation::sign:
        jump(Operation::name, in.a);
        break;
      case Operation::not_above:
        jump(Operation::subtract, in.a, in.b);
        break;
      // A denominator may touch zero at these choices: x/abs(x), x/sqrt(x^2).
      case Operation::abs:
      case Operation::smooth_abs:
        choice(Operation::name, in.a);
        break;
      case Operation::min:
      case Operation::max:
        choice(Operation::subtract, in.a, in.b);
        break;
      case Operation::multiply:
        if (in.a == in.b) choice(Operation::name, in.a);
        break;
      default:
        break;
    }
  }
  std::vector<Program> found;
  if (!may_jump) return found;
  for (const auto& [how, a, b] : all) {
    Program result;
    const Symbols none;
    ProgramBuilder(none, result).build_switch(program, how, a, b);
    if (!result.is_constant()) found.push_back(std::move(result));
  }
  return found;
}

std::vector<Program> switches_of(const Program& program) { return ProgramBuilder::switches_of(program); }

}  // namespace mbsopt
