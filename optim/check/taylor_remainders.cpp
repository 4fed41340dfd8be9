#include "optim/check/taylor_remainders.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "optim/machine/median.hpp"

namespace mbsopt::inline optim {
namespace {

struct TaylorRung {
  double h;
  Eigen::VectorXd remainder, rounding;
};

double slope_between(const TaylorRung& a, const TaylorRung& b, Eigen::Index objective) {
  return std::log(a.remainder(objective) / b.remainder(objective)) / std::log(a.h / b.h);
}

// A remainder that falls as h or faster leaves 1/4096 of itself at the smallest two h. A larger one is rounding, unless
// it falls as h^2 to the last.
double left_at_the_end(const std::vector<TaylorRung>& rungs, Eigen::Index objective, double least_slope) {
  const std::size_t n = rungs.size();
  const auto falls = [&](std::size_t j) { return slope_between(rungs[j - 1], rungs[j], objective) >= least_slope; };
  if (n >= 3 && falls(n - 1) && falls(n - 2)) return 0;
  double left = 0;
  for (std::size_t j = std::max<std::size_t>(n, 2) - 2; j < n; ++j)
    left = std::max(left, rungs[j].remainder(objective));
  return left;
}

// Large h have terms of higher order, so the later slopes count. A part that grows as h falls is rounding.
std::optional<double> slope_of(const std::vector<TaylorRung>& rungs, Eigen::Index objective, double least_slope) {
  constexpr std::ptrdiff_t kLater = 4;
  const double left = left_at_the_end(rungs, objective, least_slope);
  std::vector<double> slopes;
  for (std::size_t j = 1; j < rungs.size(); ++j) {
    if (rungs[j].remainder(objective) > kTaylorClear * std::max(rungs[j].rounding(objective), left))
      slopes.push_back(slope_between(rungs[j - 1], rungs[j], objective));
  }
  if (slopes.empty()) return std::nullopt;
  if (std::ssize(slopes) > kLater) slopes.erase(slopes.begin(), slopes.end() - kLater);
  const double slope = median(std::move(slopes));
  return slope < 0 ? std::nullopt : std::optional(slope);
}

}  // namespace

std::vector<TaylorCheck> check_taylor_remainders(
    CheckedRun& run, const Eigen::VectorXd& d, const Eigen::VectorXd& slope,
    const std::function<Eigen::VectorXd(double h, const Eigen::VectorXd& psi)>& rounding, double least_slope) {
  constexpr int kRungs = 14;
  constexpr double kLargest = 1e-2;  // of d
  std::vector<TaylorRung> rungs;
  double h = kLargest;
  for (int j = 0; j < kRungs; ++j, h /= 2)
    if (const Evaluation there = run.values(run.rho + h * d, true); there.ok)
      rungs.push_back({h, (there.psi - run.psi - h * slope).cwiseAbs(), rounding(h, there.psi)});
  std::vector<TaylorCheck> checks;
  for (Eigen::Index i = 0; i < run.psi.size(); ++i) {
    TaylorCheck check;
    check.objective = run.evaluator.objectives()[static_cast<std::size_t>(i)].name();
    for (const TaylorRung& rung : rungs) check.rows.push_back({rung.h, rung.remainder(i)});
    check.slope = slope_of(rungs, i, least_slope);
    check.passed = !rungs.empty() && (!check.slope || *check.slope >= least_slope);
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace mbsopt::inline optim
