#include "optim/fit/profile_likelihood.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"
#include "optim/solver/multipliers.hpp"

namespace mbsopt::inline optim {
namespace {

using Point = ParameterProfile::Point;

constexpr int kMostPoints = 30;       // on each side
constexpr double kProfileStep = 0.5;  // of tau, aimed at
constexpr double kLongest = 4;        // a step against the one before
constexpr double kDrawnTo = 1.15;     // of the quantile: so far the profile is drawn
constexpr double kCrossing = 1e-3;    // of the quantile
constexpr int kSecants = 8;

class Side {
 public:
  Side(LeastSquaresProblem& problem, const ProfileOptions& options, const Point& estimate, double sign)
      : problem_(problem), options_(options), estimate_(estimate), sign_(sign) {}

  // Outward until tau is beyond the quantile, or the bound of the variable is met.
  void walk(double bound) {
    double step = options_.first_step;
    Point last = estimate_;
    if (sign_ * (bound - last.value) <= 0) return end("the estimate is at its bound");
    while (static_cast<int>(points.size()) < kMostPoints) {
      const bool at_bound = sign_ * (bound - last.value) <= step;
      const std::optional<Point> next = fitted(at_bound ? bound : last.value + sign_ * step, last);
      if (!next) return;
      points.push_back(*next);
      if (std::abs(next->tau) >= options_.quantile && !crossing) find_crossing(last, *next);
      if (stopped_ || std::abs(next->tau) >= kDrawnTo * options_.quantile) return;
      if (at_bound) {
        if (!crossing) end("the data do not exclude its bound");
        return;
      }
      const double rise = std::abs(next->tau) - std::abs(last.tau), taken = std::abs(next->value - last.value);
      step = taken * std::clamp(rise > 0 ? kProfileStep / rise : kLongest, 0.25, kLongest);
      last = *next;
    }
    if (!crossing) end("the data do not bound it in the range of the search");
  }

  std::vector<Point> points;  // outward
  std::optional<double> crossing;
  std::string why_none;

 private:
  void end(const std::string& why) { why_none = why; }

  // All other variables are fitted, while equal bounds hold this one.
  std::optional<Point> fitted(double x, const Point& from) {
    const Eigen::Index k = options_.variable;
    problem_.x_lower(k) = problem_.x_upper(k) = x;
    const LeastSquaresResult fit = solve_with_equalities(problem_, from.parameters, options_.solver);
    if (fit.status == SolverStatus::failed || fit.status == SolverStatus::stopped)
      return stopped_ = fit.status == SolverStatus::stopped, end(fit.message), std::nullopt;
    Point p{x, fit.cost_final, 0, fit.x};
    const double rise = p.cost - estimate_.cost;
    if (rise < -1e-6 * (estimate_.cost + options_.likelihood_scale)) {
      end(fmt::format("a better fit was met on the way, cost {:.9g} instead of {:.9g}: start from there", p.cost,
                      estimate_.cost));
      return std::nullopt;
    }
    p.tau = sign_ * std::sqrt(2 * std::max(rise, 0.0) / options_.likelihood_scale);
    if (options_.progress && !options_.progress(p)) stopped_ = true;
    return p;
  }

  // Where |tau| is the quantile, between the last point inside and the first one outside.
  void find_crossing(Point inside, Point outside) {
    for (int i = 0; i < kSecants && !stopped_; ++i) {
      const double a = std::abs(inside.tau), b = std::abs(outside.tau);
      const double part = (options_.quantile - a) / (b - a);
      crossing = inside.value + part * (outside.value - inside.value);
      if (b - a <= kCrossing * options_.quantile) return;
      // A secant stays a tenth away from either end; nearer ones would converge slowly.
      const double x = inside.value + std::clamp(part, 0.1, 0.9) * (outside.value - inside.value);
      const std::optional<Point> next = fitted(i < 2 ? *crossing : x, inside);
      if (!next) return;
      points.push_back(*next);
      if (std::abs(std::abs(next->tau) - options_.quantile) <= kCrossing * options_.quantile) {
        crossing = next->value;
        return;
      }
      (std::abs(next->tau) < options_.quantile ? inside : outside) = *next;
    }
  }

  LeastSquaresProblem& problem_;
  const ProfileOptions& options_;
  const Point& estimate_;
  double sign_;
  bool stopped_ = false;
};

}  // namespace

ParameterProfile profile_likelihood(LeastSquaresProblem& problem, const Eigen::VectorXd& x,
                                    const ProfileOptions& options) {
  LeastSquaresPoint at;
  at.z.setZero(problem.size), at.z_x.setZero(problem.size, problem.variables());
  problem.evaluate(x, at);
  ParameterProfile profile;
  if (!at.ok) {
    profile.below = profile.above = "the estimate cannot be evaluated: " + at.message;
    return profile;
  }
  const Point estimate{x(options.variable), problem.cost(at.z), 0, x};
  const double lower = problem.x_lower(options.variable), upper = problem.x_upper(options.variable);
  Side down(problem, options, estimate, -1), up(problem, options, estimate, 1);
  down.walk(lower), up.walk(upper);
  problem.x_lower(options.variable) = lower, problem.x_upper(options.variable) = upper;
  for (Side* side : {&down, &up})
    if (!side->crossing && side->why_none.empty()) side->why_none = "stopped on request";
  profile.points = down.points;
  profile.points.push_back(estimate);
  profile.points.insert(profile.points.end(), up.points.begin(), up.points.end());
  std::ranges::sort(profile.points, {}, &Point::value);
  profile.lower = down.crossing, profile.upper = up.crossing;
  profile.below = down.why_none, profile.above = up.why_none;
  return profile;
}

std::vector<Eigen::Index> profiled_unknowns(const std::vector<std::string>& profiles,
                                            const std::vector<std::string>& names) {
  std::vector<Eigen::Index> indices;
  for (const std::string& name : profiles) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      throw std::invalid_argument(fmt::format("--profile: '{}' is not fitted{}; fitted are {}", name,
                                              did_you_mean(name, names), joined(names)));
    indices.push_back(found - names.begin());
  }
  return indices;
}

ParameterProfile profile_of(FitContext& fit, ExperimentStack& stack, Eigen::Index k, const Eigen::VectorXd& x) {
  const FitStatistics& s = fit.result.statistics;
  const std::string& name = fit.result.parameters[static_cast<std::size_t>(k)].name;
  ProfileOptions options;
  options.variable = k;
  // If the linear model gives no standard error, the first step is a hundredth of the variable.
  const double std_error = s.std_error(k) / std::abs(stack.scaling().rho_x(x)(k));
  const bool sensible = std::isfinite(std_error) && std_error > 0;
  options.first_step = sensible ? 0.5 * std_error : 0.01 * std::max(1.0, std::abs(x(k)));
  // Correlated residuals: Chandler and Bate, Biometrika 94 (2007) 167, equation 6.
  options.likelihood_scale = s.likelihood_scale * s.inflation(k), options.quantile = s.quantile;
  options.solver = solver_options(fit);
  if (!(s.likelihood_scale > 0) || !std::isfinite(s.likelihood_scale) || !std::isfinite(s.quantile)) {
    const std::string none = "the residuals have no variance to measure it by";
    return {name, {}, {}, {}, none, none};
  }
  const auto value_at = [&](double x_k) {
    Eigen::VectorXd at = x;
    at(k) = x_k;
    return stack.scaling().to_rho(at)(k);
  };
  options.progress = [&](const Point& p) {
    if (!fit.abandoned && fit.options.profile_progress)
      fit.abandoned = !fit.options.profile_progress(name, value_at(p.value), p.tau);
    return !fit.abandoned;
  };
  ParameterProfile profile = profile_likelihood(stack, x, options);
  profile.name = name;
  for (Point& p : profile.points) p.value = value_at(p.value), p.parameters = stack.scaling().to_rho(p.parameters);
  for (std::optional<double>* end : {&profile.lower, &profile.upper})
    if (*end) *end = value_at(**end);
  return profile;
}

}  // namespace mbsopt::inline optim
