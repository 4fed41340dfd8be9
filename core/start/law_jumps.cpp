#include "core/start/law_jumps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbsopt {
namespace {

constexpr double kJump = 1e-9;               // relative to the law; below it a difference has vanished
constexpr double kRoundingOfLaw = 1e-12;     // [m, rad, and these per s]: of 1 in exp(t) - 1
constexpr double kWide = 16, kSteep = 0.25;  // an interval, of the shortest; a change without jump falls by more
constexpr double kPart = 0.471;              // not half: jumps are at round times, where a law may have no value

}  // namespace

LawJumps::LawJumps(const MechanismData& data)
    : data_(data), inputs_(data.rho.data(), data.rho.data() + data.rho.size()) {
  inputs_.push_back(0);
  for (const RowLaw& law : data.laws) {
    if (!law.law.programs || law.law.smooth) continue;
    laws_.push_back(&law);
    for (const Program& p : *law.law.programs) p.grow(scratch_);
  }
}

TimeLaw::Jet LawJumps::at(const TimeLaw& law, double t) {
  inputs_.back() = t;
  return law.at(inputs_, scratch_);
}

LawJumps::Jump LawJumps::find(const TimeLaw& law, std::size_t order, double t0, double t1) {
  TimeLaw::Jet a = at(law, t0), b = at(law, t1);
  const auto difference = [&](const TimeLaw::Jet& from, const TimeLaw::Jet& to, double h) {
    return to[order] - from[order] - h / 2 * (from[order + 1] + to[order + 1]);
  };
  // A difference is compared with the size of the law and of its change at its rate; a smaller one is rounding.
  double size =
      std::max({std::abs(a[order]), std::abs(b[order]), (t1 - t0) * (std::abs(a[order + 1]) + std::abs(b[order + 1]))});
  if (order == 1) size = std::max(size, std::max(std::abs(a[0]), std::abs(b[0])) / (t1 - t0));
  const double shortest = 1e-14 * std::max(std::abs(t0), std::abs(t1));
  double wide = 0;  // the change over the last interval that is not yet so short
  while (true) {
    const double left = difference(a, b, t1 - t0);
    if (!std::isfinite(left) || std::abs(left) <= std::max(kJump * size, kRoundingOfLaw)) return {};
    const double middle = t0 + kPart * (t1 - t0), change = b[order] - a[order];
    if (t1 - t0 <= shortest || middle <= t0 || middle >= t1) {
      // At the end of a steep ramp the slope explains the change, also where the ramp ends just within the interval.
      const bool by_slope = std::abs(change) <= (t1 - t0) * (std::abs(a[order + 1]) + std::abs(b[order + 1]));
      return !by_slope && std::abs(change) > kSteep * wide ? Jump{t1, change} : Jump{};
    }
    if (t1 - t0 > kWide * shortest) wide = std::abs(change);
    const TimeLaw::Jet m = at(law, middle);
    if (std::abs(difference(a, m, middle - t0)) >= std::abs(difference(m, b, t1 - middle))) {
      t1 = middle;
      b = m;
    } else {
      t0 = middle;
      a = m;
    }
  }
}

std::string LawJumps::between(double t0, double t1) {
  for (const RowLaw* law : laws_) {
    const std::string drive = law->drive >= 0 ? data_.drive_names[mbsopt::at(law->drive)] : "?";
    if (const Jump f = find(law->law, 0, t0, t1); f.size != 0)
      return fmt::format(
          "the law of drive '{}' jumps by {:.3g} at t = {:.6g} s, which no motion follows. Let it pass smoothly, over "
          "a short time, from one value to the other",
          drive, f.size, f.t);
    if (const Jump f_t = find(law->law, 1, t0, t1); f_t.size != 0)
      return fmt::format(
          "the law of drive '{}' changes its rate by {:.3g} 1/s at once at t = {:.6g} s: an impact, whose force has no "
          "bounds. Let the rate change over a short time",
          drive, f_t.size, f_t.t);
  }
  return {};
}

}  // namespace mbsopt
