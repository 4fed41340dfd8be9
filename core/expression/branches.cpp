#include "core/expression/branches.hpp"

#include <algorithm>
#include <cmath>

#include "core/expression/program_builder.hpp"

namespace mbsopt {
namespace {

constexpr std::size_t kMostSamples = 64;    // an event at each costs more than it gains where samples are that dense
constexpr double kRoundingOfSlopes = 1e-9;  // of the largest: more digits than tables have

// The samples at which a table jumps or has a kink; none of smooth curves.
std::vector<std::size_t> kinks_of(const Program::CurveUse& use) {
  const Curve& curve = *use.curve;
  std::vector<std::size_t> found;
  if (curve.interpolation() == Interpolation::spline || use.order > curve.degree() || curve.x().size() > kMostSamples)
    return found;
  double largest = 0;
  for (std::size_t i = 0; i < curve.x().size(); ++i)
    largest = std::max({largest, std::abs(curve.at(curve.x()[i], curve.degree()))});
  for (std::size_t i = 1; i < curve.x().size(); ++i)
    if (std::abs(curve.change_at(i)) > kRoundingOfSlopes * largest) found.push_back(i);
  return found;
}

bool takes_difference(Operation f) { return f == Operation::min || f == Operation::max || f == Operation::not_above; }

// Returns whether it is the root of a square, which is abs of its base.
bool is_root_of_square(const Program& program, const Program::Instruction& in) {
  if (in.operation != Operation::sqrt) return false;
  const Program::Instruction& square = program.code()[static_cast<std::size_t>(in.a)];
  return square.operation == Operation::multiply && square.a == square.b;
}

bool may_branch(const Program::Instruction& in) {
  return takes_difference(in.operation) || in.operation == Operation::abs || in.operation == Operation::sign ||
         in.operation == Operation::sqrt || in.operation == Operation::curve;
}

// x of abs(x) and sqrt(x^2), else the instruction itself.
int base_of(const Program& program, int k) {
  const Program::Instruction& in = program.code()[static_cast<std::size_t>(k)];
  if (in.operation == Operation::abs) return in.a;
  return is_root_of_square(program, in) ? program.code()[static_cast<std::size_t>(in.a)].a : k;
}

// Returns whether x is a factor of an instruction, or abs(x) is.
bool has_factor(const Program& program, int k, int x) {
  const Program::Instruction& in = program.code()[static_cast<std::size_t>(k)];
  if (base_of(program, k) == x) return true;
  if (in.operation == Operation::negate) return has_factor(program, in.a, x);
  return in.operation == Operation::multiply && (has_factor(program, in.a, x) || has_factor(program, in.b, x));
}

// Per instruction, the least exponent of powers and roots that have no value where it is negative; infinite: none has.
// A denominator counts as the exponent -1, unless it cancels.
std::vector<double> roots_of(const Program& program) {
  const std::vector<Program::Instruction>& code = program.code();
  std::vector<double> roots(code.size(), INFINITY);
  for (std::size_t i = code.size(); i-- > 0;) {
    const auto& [f, a, b, value] = code[i];
    const auto lower = [&](int operand, double root) {
      double& known = roots[static_cast<std::size_t>(operand)];
      known = std::min(known, root);
    };
    if (f == Operation::power) {
      constexpr double kHertz = 1.5;  // where it is not known
      const Program::Instruction& n = code[static_cast<std::size_t>(b)];
      if (n.operation != Operation::number) lower(a, kHertz);
      if (n.operation == Operation::number && (n.constant < 0 || std::floor(n.constant) != n.constant))
        lower(a, n.constant);
    } else if (f == Operation::divide) {
      lower(a, roots[i]);
      if (!has_factor(program, a, base_of(program, b))) lower(b, -1);
    } else if ((f == Operation::sqrt || f == Operation::log) && !is_root_of_square(program, code[i])) {
      lower(a, 0.5);
    } else if (f == Operation::negate || f == Operation::multiply) {
      lower(a, roots[i]);
      if (f == Operation::multiply) lower(b, roots[i]);
    }
  }
  return roots;
}

}  // namespace

std::vector<Branching> branchings_of(const Program& program, int parameters, int time) {
  std::vector<Branching> found;
  if (std::ranges::none_of(program.code(), may_branch)) return found;
  const Symbols none;
  const std::vector<double> roots = roots_of(program);
  const auto is_number = [&](int k) {
    return program.code()[static_cast<std::size_t>(k)].operation == Operation::number;
  };
  const auto add = [&](std::size_t i, int a, bool of_motion, Operation how, int b, double sample) {
    if (roots[i] < 1) return;  // its slope is infinite, or it has a pole: steps that end there would hide that
    const Program::Instruction& in = program.code()[i];
    Branching branching{i, sample, {}, 1, roots[i], 0};
    if (in.operation == Operation::max || in.operation == Operation::min)
      branching.rises = (is_number(in.a) ? -1 : is_number(in.b) ? 1 : 0) * (in.operation == Operation::max ? 1 : -1);
    ProgramBuilder(none, branching.decision).build_part(program, a, how, b, sample);
    const auto varies = [&](int input) { return input >= parameters && !(of_motion && input == time); };
    if (std::ranges::any_of(branching.decision.used_inputs(), varies)) found.push_back(std::move(branching));
  };
  for (std::size_t i = 0; i < program.code().size(); ++i) {
    const Program::Instruction& in = program.code()[i];
    if (in.operation == Operation::abs || in.operation == Operation::sign)
      add(i, in.a, false, Operation::name, -1, 0);
    else if (is_root_of_square(program, in))
      add(i, program.code()[static_cast<std::size_t>(in.a)].a, false, Operation::name, -1, 0);
    else if (takes_difference(in.operation))
      add(i, in.a, false, Operation::subtract, in.b, 0);
    else if (in.operation == Operation::curve)
      for (const std::size_t k : kinks_of(program.curve_of(in)))
        add(i, in.a, true, Operation::number, -1, program.curve_of(in).curve->x()[k]);
  }
  return found;
}

Program with_branches(const Program& program, std::span<const Branching> branchings, std::span<const int> sides) {
  Program result;
  const Symbols none;
  ProgramBuilder(none, result).build_with_branches(program, branchings, sides);
  return result;
}

Program negative_of(const Program& program) {
  Program result;
  const Symbols none;
  if (!program.code().empty())
    ProgramBuilder(none, result).build_part(program, static_cast<int>(program.code().size()) - 1, Operation::negate);
  return result;
}

// a/b if b is a factor of a, else -1. So c*abs(x)/x has a value where its branch ends.
int ProgramBuilder::quotient_without(int a, int b) {
  if (a == b) return number(1);
  const Instruction of = code()[static_cast<std::size_t>(a)], by = code()[static_cast<std::size_t>(b)];
  if (by.operation == Operation::negate) {
    const int rest = quotient_without(a, by.a);
    return rest < 0 ? -1 : negative(rest);
  }
  if (of.operation == Operation::negate) {
    const int rest = quotient_without(of.a, b);
    return rest < 0 ? -1 : negative(rest);
  }
  if (of.operation != Operation::multiply) return -1;
  if (const int rest = quotient_without(of.a, b); rest >= 0) return operation(Operation::multiply, rest, of.b);
  const int rest = quotient_without(of.b, b);
  return rest < 0 ? -1 : operation(Operation::multiply, of.a, rest);
}

void ProgramBuilder::build_with_branches(const Program& of, std::span<const Branching> branchings,
                                         std::span<const int> sides) {
  std::vector<int> at(of.code_.size());
  std::size_t next = 0;  // the branchings are in the order of the instructions
  for (std::size_t i = 0; i < of.code_.size(); ++i) {
    const Instruction& in = of.code_[i];
    const bool is_leaf = operands(in.operation) == 0;
    const int a = is_leaf ? -1 : at[static_cast<std::size_t>(in.a)],
              b = is_leaf || in.b < 0 ? -1 : at[static_cast<std::size_t>(in.b)];
    const std::size_t first = next;
    while (next < branchings.size() && branchings[next].instruction == i) ++next;
    const std::span<const int> own = sides.subspan(first, next - first);
    const bool has_values = next == first || std::isinf(branchings[first].root) ||
                            own.front() * branchings[first].rises < 0;  // as a constant
    const bool holds = next > first && has_values && std::ranges::find(own, 0) == own.end();
    const int side = holds ? own.front() : 0;
    const int base = holds && in.operation == Operation::sqrt
                         ? at[static_cast<std::size_t>(of.code_[static_cast<std::size_t>(in.a)].a)]
                         : a;
    if (const int rest = in.operation == Operation::divide ? quotient_without(a, b) : -1; rest >= 0)
      at[i] = rest;
    else if (!holds)
      at[i] = copied(of, in, a, b);
    else if (in.operation == Operation::abs || in.operation == Operation::sqrt)
      at[i] = side > 0 ? base : operation(Operation::negate, base, -1);
    else if (in.operation == Operation::sign)
      at[i] = number(side);
    else if (in.operation == Operation::not_above)
      at[i] = number(side > 0 ? 0 : 1);
    else if (in.operation == Operation::curve)
      at[i] = piece(of.curve_of(in), a, branchings.subspan(first, next - first), own);
    else
      at[i] = (in.operation == Operation::max) == (side > 0) ? a : b;
  }
  keep_only_what_reaches(of.code_.empty() ? number(0) : at.back());
  program_.room_ = of.code_.size();
}

// The piece of a table after the last of the samples that the argument has passed.
int ProgramBuilder::piece(const Program::CurveUse& use, int argument, std::span<const Branching> samples,
                          std::span<const int> sides) {
  const std::vector<double>&x = use.curve->x(), &y = use.curve->y();
  std::size_t i = 0;
  for (std::size_t k = 0; k < samples.size(); ++k)
    if (sides[k] > 0) i = static_cast<std::size_t>(std::ranges::lower_bound(x, samples[k].sample) - x.begin());
  if (use.curve->interpolation() == Interpolation::hold) return number(use.order == 0 ? y[i] : 0);
  const auto line =
      std::make_shared<const Curve>(Interpolation::linear, std::vector{x[i], x[i + 1]}, std::vector{y[i], y[i + 1]});
  return curve({line, use.order}, argument);
}

}  // namespace mbsopt
