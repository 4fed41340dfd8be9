#include "core/expression/program_switches.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/expression/program_builder.hpp"

namespace mbsopt {

// how selects cos of a, 1/a (divide), a - b (subtract), a - from (number), or a itself (name).
void ProgramBuilder::build_switch(const Program& of, Operation how, int a, int b, double from) {
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
                         : how == Operation::number   ? operation(Operation::subtract, first, number(from))
                                                      : first);
}

// The samples of a table at which its slope changes by a tenth of itself. Other tables follow smooth functions: some
// samples stand for all.
template <class CurveUse>
static std::vector<double> corners(const CurveUse& use) {
  constexpr double kPart = 0.1;
  constexpr std::size_t kSome = 32;
  std::vector<double> found;
  if (use.order > 0 || use.curve->interpolation() != Interpolation::linear) return found;
  const std::vector<double>&x = use.curve->x(), &y = use.curve->y();
  const auto slope = [&](std::size_t i) { return std::abs(y[i + 1] - y[i]) / (x[i + 1] - x[i]); };
  for (std::size_t i = 1; i + 1 < x.size(); ++i)
    if (std::abs(use.curve->change_at(i)) > kPart * std::max(slope(i - 1), slope(i)) || i % (x.size() / kSome + 1) == 0)
      found.push_back(x[i]);
  return found;
}

std::vector<Program> ProgramBuilder::switches_of(const Program& program) {
  using Switches = std::set<std::tuple<Operation, int, int, double>>;
  Switches all, choices;  // choices: where nothing but a denominator changes
  bool may_jump = false;
  for (const Instruction& in : program.code_) {
    const auto kink = [&](Operation how, int a, int b = -1) { all.insert({how, a, b, 0}); };
    const auto choice = [&](Operation how, int a) { choices.insert({how, a, -1, 0}); };
    const auto jump = [&](Operation how, int a, int b = -1) { may_jump = true, kink(how, a, b); };
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
      case Operation::abs:
      case Operation::smooth_abs:
      case Operation::tanh:
      case Operation::atan:
        kink(Operation::name, in.a);
        break;
      case Operation::min:
      case Operation::max:
        kink(Operation::subtract, in.a, in.b);
        break;
      case Operation::curve:
        for (const double x : corners(program.curve_of(in))) all.insert({Operation::number, in.a, -1, x});
        break;
      // A denominator may touch zero at these choices: x/abs(x), x/sqrt(x^2).
      case Operation::multiply:
        if (in.a == in.b) choice(Operation::name, in.a);
        break;
      default:
        break;
    }
  }
  std::vector<Program> found;
  if (may_jump) all.merge(choices);
  for (const auto& [how, a, b, from] : all) {
    Program result;
    const Symbols none;
    ProgramBuilder(none, result).build_switch(program, how, a, b, from);
    if (!result.is_constant()) found.push_back(std::move(result));
  }
  return found;
}

std::vector<Program> switches_of(const Program& program) { return ProgramBuilder::switches_of(program); }

}  // namespace mbsopt
