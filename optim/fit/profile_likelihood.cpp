#include "optim/fit/profile_likelihood.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optim/solver/equality_multipliers.hpp"

namespace mbsopt {
namespace {

constexpr int kMostPoints = 30;       // on each side
constexpr double kProfileStep = 0.5;  // of tau, aimed at
constexpr double kLongest = 4;        // a step against the one before
constexpr double kBeyond = 1.15;      // of the quantile: so far the profile is drawn
constexpr double kCrossing = 1e-3;    // of the quantile
constexpr int kSecants = 8;

// The problem with one variable held.
class OneHeld : public LeastSquaresProblem {
 public:
  OneHeld(LeastSquaresProblem& whole, Eigen::Index held)
      : LeastSquaresProblem(whole.variables() - 1, whole.size), whole_(whole), held_(held) {
    x_lower = without(whole.x_lower), x_upper = without(whole.x_upper);
    equalities = whole.equalities, plain = whole.plain, loss = whole.loss, parts = whole.parts;
    for (Dependence& part : parts) {
      std::erase(part.variables, held);
      for (Eigen::Index& variable : part.variables) variable -= variable > held ? 1 : 0;
    }
    all_.z.resize(size), all_.z_x.resize(size, whole.variables());
  }
  void hold(double value) { value_ = value; }
  Eigen::VectorXd without(const Eigen::VectorXd& x) const {
    Eigen::VectorXd rest(x.size() - 1);
    rest << x.head(held_), x.tail(x.size() - held_ - 1);
    return rest;
  }
  Eigen::VectorXd with(const Eigen::VectorXd& rest) const {
    Eigen::VectorXd x(rest.size() + 1);
    x << rest.head(held_), value_, rest.tail(rest.size() - held_);
    return x;
  }
  void evaluate(const Eigen::VectorXd& rest, LeastSquaresPoint& point) override {
    all_.ok = true, all_.z.setZero(), all_.z_x.setZero();
    whole_.evaluate(with(rest), all_);
    point.ok = all_.ok, point.message = all_.message, point.z = all_.z;
    point.z_x << all_.z_x.leftCols(held_), all_.z_x.rightCols(variables() - held_);
  }

 private:
  LeastSquaresProblem& whole_;
  Eigen::Index held_;
  double value_ = 0;
  LeastSquaresPoint all_;
};

class Side {
 public:
  Side(LeastSquaresProblem& problem, OneHeld& held, const ProfileOptions& options, const ProfilePoint& estimate,
       double sign)
      : problem_(problem), held_(held), options_(options), estimate_(estimate), sign_(sign) {}

  // Outward until tau is beyond the quantile, or a bound is met.
  void walk() {
    const double bound = sign_ < 0 ? problem_.x_lower(options_.variable) : problem_.x_upper(options_.variable);
    double step = options_.first_step;
    ProfilePoint last = estimate_;
    if (sign_ * (bound - last.x) <= 0) return end("the estimate is at its bound");
    while (static_cast<int>(points.size()) < kMostPoints) {
      const bool at_bound = sign_ * (bound - last.x) <= step;
      const std::optional<ProfilePoint> next = fitted(at_bound ? bound : last.x + sign_ * step, last);
      if (!next) return;
      points.push_back(*next);
      if (std::abs(next->tau) >= options_.quantile && !crossing) find_crossing(last, *next);
      if (stopped_ || std::abs(next->tau) >= kBeyond * options_.quantile) return;
      if (at_bound) {
        if (!crossing) end("the data do not exclude its bound");
        return;
      }
      const double rise = std::abs(next->tau) - std::abs(last.tau), taken = std::abs(next->x - last.x);
      step = taken * std::clamp(rise > 0 ? kProfileStep / rise : kLongest, 0.25, kLongest);
      last = *next;
    }
    if (!crossing) end("the data do not bound it in the range of the search");
  }

  std::vector<ProfilePoint> points;  // outward
  std::optional<double> crossing;
  std::string why_none;

 private:
  void end(const std::string& why) { why_none = why; }

  std::optional<ProfilePoint> fitted(double x, const ProfilePoint& from) {
    held_.hold(x);
    ProfilePoint p;
    p.x = x;
    const Eigen::VectorXd start = held_.without(from.variables);
    if (start.size() == 0) {
      LeastSquaresPoint point;
      point.z.setZero(held_.size), point.z_x.setZero(held_.size, 0);
      held_.evaluate(start, point);
      if (!point.ok) return end("it could not be evaluated there: " + point.message), std::nullopt;
      p.cost = held_.cost(point.z), p.variables = held_.with(start);
    } else {
      const LeastSquaresResult fit = solve_with_equalities(held_, start, options_.solver);
      if (fit.status == SolverStatus::failed || fit.status == SolverStatus::stopped)
        return stopped_ = fit.status == SolverStatus::stopped, end(fit.message), std::nullopt;
      p.cost = fit.cost_final, p.variables = held_.with(fit.x);
    }
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
  void find_crossing(ProfilePoint inside, ProfilePoint outside) {
    for (int i = 0; i < kSecants && !stopped_; ++i) {
      const double a = std::abs(inside.tau), b = std::abs(outside.tau);
      const double part = (options_.quantile - a) / (b - a);
      crossing = inside.x + part * (outside.x - inside.x);
      if (b - a <= kCrossing * options_.quantile) return;
      // A secant stays a tenth away from either end; nearer ones would converge slowly.
      const double x = inside.x + std::clamp(part, 0.1, 0.9) * (outside.x - inside.x);
      const std::optional<ProfilePoint> next = fitted(i < 2 ? *crossing : x, inside);
      if (!next) return;
      points.push_back(*next);
      if (std::abs(std::abs(next->tau) - options_.quantile) <= kCrossing * options_.quantile) {
        crossing = next->x;
        return;
      }
      (std::abs(next->tau) < options_.quantile ? inside : outside) = *next;
    }
  }

  LeastSquaresProblem& problem_;
  OneHeld& held_;
  const ProfileOptions& options_;
  const ProfilePoint& estimate_;
  double sign_;
  bool stopped_ = false;
};

}  // namespace

Profile profile_likelihood(LeastSquaresProblem& problem, const Eigen::VectorXd& x, const ProfileOptions& options) {
  OneHeld held(problem, options.variable);
  LeastSquaresPoint at;
  at.z.setZero(problem.size), at.z_x.setZero(problem.size, problem.variables());
  problem.evaluate(x, at);
  Profile profile;
  if (!at.ok) {
    profile.below = profile.above = "the estimate cannot be evaluated: " + at.message;
    return profile;
  }
  const ProfilePoint estimate{x(options.variable), problem.cost(at.z), 0, x};
  Side down(problem, held, options, estimate, -1), up(problem, held, options, estimate, 1);
  for (Side* side : {&down, &up}) {
    side->walk();
    if (!side->crossing && side->why_none.empty()) side->why_none = "stopped on request";
  }
  profile.points = down.points;
  profile.points.push_back(estimate);
  profile.points.insert(profile.points.end(), up.points.begin(), up.points.end());
  std::sort(profile.points.begin(), profile.points.end(),
            [](const ProfilePoint& a, const ProfilePoint& b) { return a.x < b.x; });
  profile.lower = down.crossing, profile.upper = up.crossing;
  profile.below = down.why_none, profile.above = up.why_none;
  return profile;
}

}  // namespace mbsopt
