#include "optim/design/true_limits.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt {
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

TrueLimits::TrueLimits(const DesignSpec& spec, const CaseEvaluator& evaluator) {
  const std::size_t bounds = spec.subject_to.size();
  for (std::size_t i = 0; i < bounds * evaluator.cases(); ++i) {
    if (!evaluator.of_case(i / bounds).objectives()[i % bounds + 1].is_extreme()) continue;
    const ObjectiveBound& bound = spec.subject_to[i % bounds];
    limits_.push_back({static_cast<Eigen::Index>(i), bound.lower, bound.upper, 1, bound.lower, bound.upper});
  }
}

bool TrueLimits::is_settled(const Limit& l, double psi, double X) {
  const bool equality = l.lower && l.upper && *l.lower == *l.upper;
  if (equality) return std::abs(X - *l.upper) <= kUnused * l.size;
  const auto on = [&](const std::optional<double>& bound) {
    return bound && std::abs(psi - *bound) <= kOnBound * l.size;
  };
  if (l.upper && (X > *l.upper || (on(l.smooth_upper) && X < *l.upper - kUnused * l.size))) return false;
  if (l.lower && (X < *l.lower || (on(l.smooth_lower) && X > *l.lower + kUnused * l.size))) return false;
  return true;
}

void TrueLimits::learn(Limit& l, double psi, double X) {
  if (l.psi && std::abs(psi - *l.psi) > kNoChange * l.size)
    l.slope = std::clamp((X - *l.X) / (psi - *l.psi), kLeastSlope, kLargestSlope);
  l.psi = psi, l.X = X;
}

void TrueLimits::move(Limit& l, double psi, double X) {
  const double inside = l.lower && l.upper && *l.lower == *l.upper ? 0 : 0.5 * kUnused * l.size;
  if (l.upper) l.smooth_upper = psi + (*l.upper - inside - X) / l.slope;
  if (l.lower) l.smooth_lower = psi + (*l.lower + inside - X) / l.slope;
}

bool TrueLimits::move(DesignProgram& program, const Eigen::VectorXd& c,
                      const std::vector<std::optional<double>>& true_values) {
  bool moved = false;
  for (Limit& l : limits_) {
    const std::optional<double>& X = true_values[static_cast<std::size_t>(program.psi_of(l.constraint))];
    if (!X) continue;
    l.size = program.size(l.constraint);
    const double value = c(l.constraint) * l.size;
    learn(l, value, *X);
    if (is_settled(l, value, *X)) continue;
    moved = true;
    if (rounds_ < kRounds) move(l, value, *X), program.set_bounds(l.constraint, l.smooth_lower, l.smooth_upper);
  }
  if (!moved || rounds_ == kRounds) return false;
  ++rounds_;
  return true;
}

double TrueLimits::slope(Eigen::Index constraint) const {
  const auto limit = std::ranges::find(limits_, constraint, &Limit::constraint);
  return limit == limits_.end() ? 1 : limit->slope;
}

}  // namespace mbsopt
