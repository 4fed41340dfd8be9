#include "core/expression/program_range.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mbsopt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Range kAll{-kInfinity, kInfinity, false};

bool holds(const Range& r, double x) { return r.low <= x && x <= r.high; }

void widen(Range& r, double x) {
  if (std::isnan(x)) r = kAll;
  r.low = std::min(r.low, x);
  r.high = std::max(r.high, x);
}

// sin takes its peaks at pi/2 + k pi, with the sign of cos(k pi).
Range range_of_sin(const Range& a) {
  const double pi = std::numbers::pi;
  if (!(a.high - a.low < 2 * pi)) return {-1, 1};
  Range r{std::min(std::sin(a.low), std::sin(a.high)), std::max(std::sin(a.low), std::sin(a.high))};
  for (double k = std::ceil(a.low / pi - 0.5); pi * (k + 0.5) <= a.high; ++k) widen(r, std::fmod(k, 2) == 0 ? 1 : -1);
  return r;
}

// Each other operation is monotone in one operand, the other one held, apart from a turn at 0. So its extremes lie at
// ends and zeros.
Range range_of(Operation operation, const Range& a, const Range& b, bool same) {
  const double quarter = std::numbers::pi / 2;
  switch (operation) {
    case Operation::sin:
      return range_of_sin(a);
    case Operation::cos:
      return range_of_sin({a.low + quarter, a.high + quarter});
    case Operation::tan:
      if (std::floor(a.low / (2 * quarter) + 0.5) != std::floor(a.high / (2 * quarter) + 0.5)) return kAll;
      break;
    case Operation::divide:
      if (holds(b, 0)) return kAll;
      break;
    case Operation::power:
      if (holds(a, 0) && b.low < 0) return kAll;
      break;
    case Operation::atan2:
      if (holds(a, 0) && b.low <= 0) return {-2 * quarter, 2 * quarter};
      break;
    default:
      break;
  }
  Range r{kInfinity, -kInfinity};
  for (const double x : {a.low, a.high, holds(a, 0) ? 0.0 : a.low}) {
    if (same)
      widen(r, apply(operation, x, x));
    else
      for (const double y : {b.low, b.high, holds(b, 0) ? 0.0 : b.low}) widen(r, apply(operation, x, y));
  }
  return r;
}

// Splines between samples may pass beyond them.
Range range_of(const Program::CurveUse& use, const Range& a) {
  const auto& [f, order] = use;
  const Curve& curve = *f;
  Range r{kInfinity, -kInfinity};
  widen(r, curve.at(a.low, order));
  widen(r, curve.at(a.high, order));
  if (curve.is_routine()) return r;
  const auto last = std::upper_bound(curve.x().begin(), curve.x().end(), a.high);
  for (auto x = std::lower_bound(curve.x().begin(), last, a.low); x != last; ++x) widen(r, curve.at(*x, order));
  const double beyond = curve.interpolation() == Interpolation::spline ? 0.25 * (r.high - r.low) : 0;
  return {r.low - beyond, r.high + beyond};
}

}  // namespace

void ranges_of(const Program& program, std::span<const Range> x, std::vector<Range>& range) {
  range.resize(program.code().size());
  for (std::size_t i = 0; i < range.size(); ++i) {
    const Program::Instruction& in = program.code()[i];
    if (in.operation == Operation::number) {
      range[i] = {in.constant, in.constant};
    } else if (in.operation == Operation::name) {
      range[i] = x[static_cast<std::size_t>(in.a)];
    } else if (const Range& a = range[static_cast<std::size_t>(in.a)]; in.operation == Operation::curve) {
      range[i] = range_of(program.curve_of(in), a);
    } else {
      const Range& b = in.b < 0 ? Range{} : range[static_cast<std::size_t>(in.b)];
      range[i] = range_of(in.operation, a, b, in.a == in.b);
      range[i].turns = (in.operation == Operation::abs || in.operation == Operation::smooth_abs) && a.low < 0 &&
                       a.high > 0 && std::max(-a.low, a.high) > std::abs(b.high);
    }
  }
}

}  // namespace mbsopt
