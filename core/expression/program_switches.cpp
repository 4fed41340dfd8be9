#include "core/expression/program_switches.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "core/expression/program_builder.hpp"

namespace mbsopt {
namespace {

// The samples of a table at which its slope changes by a tenth of itself. Other tables follow smooth functions: some
// samples stand for all.
std::vector<double> corners(const Program::CurveUse& use) {
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

}  // namespace

std::vector<Program> switches_of(const Program& program) {
  using Switches = std::set<std::tuple<Operation, int, int, double>>;
  Switches all, choices;  // choices: where nothing but a denominator changes
  bool may_jump = false;
  for (const Program::Instruction& in : program.code()) {
    const auto kink = [&](Operation how, int a, int b = -1) { all.insert({how, a, b, 0}); };
    const auto choice = [&](Operation how, int a) { choices.insert({how, a, -1, 0}); };
    const auto jump = [&](Operation how, int a, int b = -1) { may_jump = true, kink(how, a, b); };
    switch (in.operation) {
      case Operation::divide:
        jump(Operation::name, in.b);
        break;
      case Operation::power: {
        const Program::Instruction& exponent = program.code()[static_cast<std::size_t>(in.b)];
        const bool continuous = exponent.operation == Operation::number && exponent.constant >= 0;
        continuous ? choice(Operation::name, in.a) : jump(Operation::name, in.a);
        break;
      }
      case Operation::atan2:
        jump(Operation::name, in.a);
        jump(Operation::name, in.b);
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
    ProgramBuilder(none, result).build_part(program, a, how, b, from);
    if (!result.is_constant()) found.push_back(std::move(result));
  }
  return found;
}

std::vector<SampledFunction> sampled_functions_of(const Program& program) {
  std::vector<SampledFunction> found;
  const Symbols none;
  std::map<int, Program> arguments;  // many functions have the same: those of parameters at the samples
  for (const Program::Instruction& in : program.code()) {
    if (in.operation != Operation::curve) continue;
    const auto [argument, is_new] = arguments.try_emplace(in.a);
    if (is_new) ProgramBuilder(none, argument->second).build_part(program, in.a);
    found.push_back({program.curve_of(in), argument->second});
  }
  return found;
}

}  // namespace mbsopt
