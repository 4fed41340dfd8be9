#include "optim/design/true_limits.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt::inline optim {
namespace {

// All relative to the size of the bounds.
constexpr double kUnused = kTrueLimitTolerance;  // what an inequality may leave unused of what it allows
constexpr double kOnBound = 1e-5;  // the smooth value is on its bound: the barrier keeps solutions this near to it
// Rounds converge like a secant method, in three to five; where a peak gives way to another one they need some more.
constexpr int kRounds = 12;
// The range in which a secant gives the slope of the true extreme in the smooth one. Beyond it other peaks, or
// variables that moved without need, determine the slope.
constexpr double kLeastSlope = 0.2, kLargestSlope = 20;
// A change of psi below it is lost in what solutions scatter by.
constexpr double kNoChange = 1e-4;

}  // namespace

TrueLimits::TrueLimits(const DesignProgram& program) {
  for (Eigen::Index i = 0; i < program.constraints(); ++i) {
    const ObjectiveBound& bound = program.bound(i);
    if (program.limited(i).is_extreme())
      limits_.push_back({i, bound.lower, bound.upper, program.size(i), bound.lower, bound.upper});
  }
}

bool TrueLimits::is_kept(const Limit& l, double X) {
  const double tolerance = is_equality(l) ? kUnused * l.size : 0;
  return (!l.upper || X <= *l.upper + tolerance) && (!l.lower || X >= *l.lower - tolerance);
}

bool TrueLimits::is_settled(const Limit& l, double psi, double X, int side) {
  if (!is_kept(l, X)) return false;
  const auto on = [&](const std::optional<double>& bound) { return std::abs(psi - *bound) <= kOnBound * l.size; };
  if (l.upper && (side > 0 || on(l.smooth_upper)) && X < *l.upper - kUnused * l.size) return false;
  if (l.lower && (side < 0 || on(l.smooth_lower)) && X > *l.lower + kUnused * l.size) return false;
  return true;
}

void TrueLimits::learn(Limit& l, double psi, double X) {
  if (l.psi && std::abs(psi - *l.psi) > kNoChange * l.size)
    l.slope = std::clamp((X - *l.X) / (psi - *l.psi), kLeastSlope, kLargestSlope);
  l.psi = psi;
  l.X = X;
}

void TrueLimits::move(Limit& l, double psi, double X) {
  const double inside = is_equality(l) ? 0 : 0.5 * kUnused * l.size;
  if (l.upper) l.smooth_upper = psi + (*l.upper - inside - X) / l.slope;
  if (l.lower) l.smooth_lower = psi + (*l.lower + inside - X) / l.slope;
}

void TrueLimits::set_bounds(const Limit& l, int held, DesignProgram& program) {
  program.set_bounds(l.constraint, held > 0 ? l.smooth_upper : l.smooth_lower,
                     held < 0 ? l.smooth_lower : l.smooth_upper);
}

bool TrueLimits::move(DesignProgram& program, const Eigen::VectorXd& c,
                      const std::vector<std::optional<double>>& true_values, const Eigen::VectorXi& sides) {
  const bool all_kept = hold(program, true_values);
  bool moved = false;
  for (Limit& l : limits_) {
    const std::optional<double>& X = true_values[static_cast<std::size_t>(program.psi_of(l.constraint))];
    if (!X) continue;
    const double value = c(l.constraint) * l.size;
    const int side = all_kept && !is_equality(l) ? sides(l.constraint) : 0;
    const bool released = l.held * sides(l.constraint) < 0;
    learn(l, value, *X);
    if (!released && is_settled(l, value, *X, side)) continue;
    moved = true;
    if (rounds_ == kRounds) continue;
    if (released) {
      l.held = 0;
      l.may_be_held = false;
    }
    if (l.may_be_held && side != 0) l.held = side;
    move(l, value, *X);
    set_bounds(l, l.held, program);
  }
  if (!moved || rounds_ == kRounds) return false;
  ++rounds_;
  return true;
}

bool TrueLimits::hold(const DesignProgram& program, const std::vector<std::optional<double>>& true_values) const {
  return std::ranges::all_of(limits_, [&](const Limit& l) {
    const std::optional<double>& X = true_values[static_cast<std::size_t>(program.psi_of(l.constraint))];
    return X && is_kept(l, *X);
  });
}

void TrueLimits::set_inequalities(DesignProgram& program) const {
  for (const Limit& l : limits_) set_bounds(l, 0, program);
}

double TrueLimits::slope(Eigen::Index constraint) const {
  const auto limit = std::ranges::find(limits_, constraint, &Limit::constraint);
  return limit == limits_.end() ? 1 : limit->slope;
}

}  // namespace mbsopt::inline optim
