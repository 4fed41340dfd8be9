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

namespace {

// An operation changes where an operand, its cosine (cos) or the difference of both (subtract) is zero.
struct Change {
  Operation operation, how;
  int Program::Instruction::*operand;
  bool jumps;  // else only its slope changes
};
constexpr auto kA = &Program::Instruction::a, kB = &Program::Instruction::b;
constexpr Change kChanges[] = {
    {Operation::divide, Operation::name, kB, true},   {Operation::atan2, Operation::name, kA, true},
    {Operation::atan2, Operation::name, kB, true},    {Operation::tan, Operation::cos, kA, true},
    {Operation::sign, Operation::name, kA, true},     {Operation::not_above, Operation::subtract, kA, true},
    {Operation::abs, Operation::name, kA, false},     {Operation::smooth_abs, Operation::name, kA, false},
    {Operation::tanh, Operation::name, kA, false},    {Operation::atan, Operation::name, kA, false},
    {Operation::min, Operation::subtract, kA, false}, {Operation::max, Operation::subtract, kA, false}};

}  // namespace

std::vector<Program> switches_of(const Program& program) {
  using Switches = std::set<std::tuple<Operation, int, int, double>>;
  Switches all, choices;  // choices: a denominator may touch zero there, as of x/abs(x) and x/sqrt(x^2)
  bool may_jump = false;
  for (const Program::Instruction& in : program.code()) {
    for (const Change& change : kChanges) {
      if (change.operation != in.operation) continue;
      all.insert({change.how, in.*change.operand, change.how == Operation::subtract ? in.b : -1, 0});
      may_jump = may_jump || change.jumps;
    }
    if (in.operation == Operation::power) {
      const Program::Instruction& exponent = program.code()[static_cast<std::size_t>(in.b)];
      const bool continuous = exponent.operation == Operation::number && exponent.constant >= 0;
      (continuous ? choices : all).insert({Operation::name, in.a, -1, 0});
      may_jump = may_jump || !continuous;
    }
    if (in.operation == Operation::multiply && in.a == in.b) choices.insert({Operation::name, in.a, -1, 0});
    if (in.operation == Operation::curve)
      for (const double x : corners(program.curve_of(in))) all.insert({Operation::number, in.a, -1, x});
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
