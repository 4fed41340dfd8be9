#include "core/expression/time_parts.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "core/expression/program_builder.hpp"
#include "core/expression/program_range.hpp"

namespace mbsopt {
namespace {

constexpr int kSamples = 6;          // of a piece: two fourth differences, of which a step at its middle has one
constexpr double kCubic = 1e-2;      // a fourth difference, of the range of the samples; a kink has half of it or more
constexpr double kWider = 1.2;       // a range than that of the samples, which miss extremes by less; not aliased waves
constexpr double kHidden = 0.1;      // of all that the term varies in the run: what may hide between samples
constexpr double kFlat = 1e-9;       // of the same: the rest of a kink, also where large terms leave a small pulse
constexpr double kRounding = 1e-12;  // of the value
constexpr double kNarrow = 1e-13;    // of the run: a jump
constexpr std::size_t kMostPieces = 1 << 15;

using Instruction = Program::Instruction;

}  // namespace

std::vector<Program> time_parts_of(const Program& program, int parameters, int time) {
  enum Kind : char { fixed, linear, curved, sampled, of_motion };  // a value is at least as its operands are
  std::vector<Kind> kinds;
  std::set<std::pair<int, Operation>> parts;
  for (const Instruction& in : program.code()) {
    if (operands(in.operation) == 0) {
      const bool is_name = in.operation == Operation::name;
      kinds.push_back(!is_name || (in.a < parameters && in.a != time) ? fixed : in.a == time ? linear : of_motion);
      continue;
    }
    const auto kind = [&](int k) { return k < 0 ? fixed : kinds[static_cast<std::size_t>(k)]; };
    const Operation f = in.operation;
    Kind here = std::max(kind(in.a), kind(in.b));
    if (here == linear) {
      const bool scales = f == Operation::multiply ? std::min(kind(in.a), kind(in.b)) == fixed
                                                   : f == Operation::divide && kind(in.b) == fixed;
      const bool sums = f == Operation::add || f == Operation::subtract || f == Operation::negate;
      here = f == Operation::curve && !program.curve_of(in).curve->is_routine() ? sampled
             : sums || scales                                                   ? linear
                                                                                : curved;
    }
    if (here > curved) {
      if (kind(in.a) == curved) parts.insert({in.a, Operation::name});
      if (kind(in.b) == curved) parts.insert({in.b, f == Operation::divide ? f : Operation::name});
    }
    kinds.push_back(here);
  }
  if (!kinds.empty() && kinds.back() == curved) parts.insert({static_cast<int>(kinds.size()) - 1, Operation::name});
  std::vector<Program> found(parts.size());
  const Symbols none;
  auto part = found.begin();
  for (const auto& [k, how] : parts) ProgramBuilder(none, *part++).build_part(program, k, how);
  return found;
}

namespace {

// The instructions that change with inputs whose rate is not 0 and that sums and products alone join to the result.
std::vector<int> terms_of(const Program& part, const std::vector<double>& rates) {
  const std::vector<Instruction>& code = part.code();
  std::vector<char> changes(code.size(), 0), joins(code.size(), 0);
  std::vector<int> terms;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const auto [f, a, b, value] = code[i];
    changes[i] = operands(f) == 0
                     ? f == Operation::name && rates[static_cast<std::size_t>(a)] != 0
                     : changes[static_cast<std::size_t>(a)] || (b >= 0 && changes[static_cast<std::size_t>(b)]);
  }
  if (!code.empty()) joins.back() = 1;
  for (std::size_t i = code.size(); i-- > 0;) {
    if (!joins[i] || !changes[i]) continue;
    const auto [f, a, b, value] = code[i];
    if (f == Operation::add || f == Operation::subtract || f == Operation::multiply || f == Operation::negate ||
        (f == Operation::divide && !changes[static_cast<std::size_t>(b)])) {
      joins[static_cast<std::size_t>(a)] = 1;
      if (b >= 0) joins[static_cast<std::size_t>(b)] = 1;
    } else if (operands(f) > 0) {
      terms.push_back(static_cast<int>(i));
    }
  }
  return terms;
}

// The inputs are x + rates t.
std::vector<double> pieces_along(const Program& part, const std::vector<double>& x, const std::vector<double>& rates,
                                 double start, double end) {
  struct Term {
    std::size_t at;
    Range all{INFINITY, -INFINITY, false};  // of every sample so far
    double f[kSamples] = {};
  };
  std::vector<Term> terms;
  for (const int k : terms_of(part, rates)) terms.push_back({static_cast<std::size_t>(k)});
  Program::Scratch scratch = part.scratch();
  std::vector<double> inputs(x);
  std::vector<Range> input_ranges(x.size()), ranges;
  const auto is_resolved = [&](Term& term) {
    const auto [low, high] = std::minmax_element(term.f, term.f + kSamples);
    if (std::none_of(term.f, term.f + kSamples, [](double f) { return std::isfinite(f); })) return true;
    double difference = 0;
    for (const double* f = term.f; f + 4 < term.f + kSamples; ++f)
      difference = std::max(difference, std::abs(f[0] - 4 * f[1] + 6 * f[2] - 4 * f[3] + f[4]));
    if (std::isfinite(difference)) term.all = {std::min(term.all.low, *low), std::max(term.all.high, *high)};
    const double size = term.all.high - term.all.low, width = ranges[term.at].high - ranges[term.at].low;
    return width <= kFlat * size + kRounding * std::abs(*high) ||
           (!ranges[term.at].turns && difference <= kCubic * (*high - *low) &&
            width <= std::max(kWider * (*high - *low), kHidden * size));
  };
  std::vector<double> instants{start};
  std::vector<Range> pieces{{start, end, false}};
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const double t0 = pieces[k].low, t1 = pieces[k].high;
    for (int j = 0; j < kSamples; ++j) {
      const double t = t0 + (t1 - t0) * j / (kSamples - 1);
      for (std::size_t i = 0; i < x.size(); ++i) inputs[i] = x[i] + rates[i] * t;
      part.value(inputs, scratch);
      for (Term& term : terms) term.f[j] = scratch.value[term.at];
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      const auto [low, high] = std::minmax({x[i] + rates[i] * t0, x[i] + rates[i] * t1});
      input_ranges[i] = {low, high, false};
    }
    ranges_of(part, input_ranges, ranges);
    bool resolved = true;
    for (Term& term : terms) resolved = is_resolved(term) && resolved;
    if (resolved || t1 - t0 <= kNarrow * (end - start) || pieces.size() >= kMostPieces) {
      instants.push_back(t1);
    } else {
      const double middle = 0.5 * (t0 + t1);
      pieces.push_back({t0, middle, false});
      pieces.push_back({middle, t1, false});
    }
  }
  std::sort(instants.begin(), instants.end());
  return instants;
}

}  // namespace

std::vector<double> pieces_of(const Program& part, int time, std::vector<double> x, double start, double end) {
  std::vector<double> rates(x.size(), 0.0);
  x[static_cast<std::size_t>(time)] = 0;
  rates[static_cast<std::size_t>(time)] = 1;
  return pieces_along(part, x, rates, start, end);
}

std::vector<double> pieces_between(const Program& part, const std::vector<double>& from,
                                   const std::vector<double>& to) {
  std::vector<double> rates;
  for (std::size_t i = 0; i < from.size(); ++i) rates.push_back(to[i] - from[i]);
  return pieces_along(part, from, rates, 0, 1);
}

// Between two pieces of ordinary width a jump keeps its size down to two neighbouring numbers.
std::vector<double> jumps_of(const Program& part, int time, std::vector<double> x, const std::vector<double>& pieces) {
  Program::Scratch scratch = part.scratch();
  const auto value = [&](double t) {
    x[static_cast<std::size_t>(time)] = t;
    return part.value(x, scratch);
  };
  std::vector<double> jumps;
  double size = 0;
  for (const double t : pieces)
    if (const double f = std::abs(value(t)); std::isfinite(f)) size = std::max(size, f);
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    double t0 = pieces[i - 1], t1 = pieces[i];
    if (t1 - t0 > kNarrow * (pieces.back() - pieces.front())) continue;
    double f0 = value(t0), f1 = value(t1);
    const double change = std::abs(f1 - f0);
    for (double t = std::midpoint(t0, t1); t > t0 && t < t1; t = std::midpoint(t0, t1)) {
      const double f = value(t);
      if (std::abs(f - f0) < std::abs(f1 - f)) {
        t0 = t;
        f0 = f;
      } else {
        t1 = t;
        if (std::isnan(f)) break;  // abs(x)/x has no value at its jump
        f1 = f;
      }
    }
    // At a pole it grows, and beside one it falls.
    const double jump = std::abs(f1 - f0);
    if (jump > kFlat * size && jump >= 0.5 * change && jump <= 2 * change) jumps.push_back(t1);
  }
  return jumps;
}

}  // namespace mbsopt
