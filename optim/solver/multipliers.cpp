#include "optim/solver/multipliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace mbsopt::inline optim {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The problem of one round. The last rows of z are those of the conditions.
class MultiplierRound : public LeastSquaresProblem {
 public:
  MultiplierRound(LeastSquaresProblem& given, VectorXd c_lower, VectorXd c_upper)
      : LeastSquaresProblem(given.variables(), given.size),
        given_(given),
        lower_(std::move(c_lower)),
        upper_(std::move(c_upper)),
        l_(VectorXd::Zero(lower_.size())) {
    x_lower = given.x_lower;
    x_upper = given.x_upper;
    plain = given.plain + lower_.size();
    loss = given.loss;
    groups = given.groups;
    parts = given.parts;
  }

  void evaluate(const VectorXd& x, LeastSquaresPoint& point) override {
    if (at_x_.z.size() > 0 && x == x_) {  // the end of the last round
      point = at_x_;
    } else {
      ++evaluations_;
      given_.evaluate(x, point);
      is_integrated = given_.is_integrated;
      if (!point.ok) return;
    }
    last = {x, 0.5 * residuals_of(point).squaredNorm()};
    if (w_.size() == 0) w_ = weights_from(point);
    const VectorXd c = point.z.tail(l_.size()), beyond = beyond_limits(shifted(c));
    const MatrixXd c_x = point.z_x.bottomRows(l_.size());
    const Eigen::Array<bool, Eigen::Dynamic, 1> acts = beyond.array() != 0 || lower_.array() == upper_.array();
    point.z.tail(l_.size()) = w_.cwiseProduct(beyond);
    point.z_x.bottomRows(l_.size()).array().colwise() *= acts.select(w_.array(), 0.0);
    if (const double round_cost = cost(point.z); round_cost <= best_.cost) best_ = {x, c, c_x, round_cost};
  }

  // One search more, from all.x, with the iterations that are left. `all` becomes the result of all searches. Returns
  // the number of failed evaluations in this one, or none if no search can follow.
  std::optional<long> solve(const LeastSquaresOptions& options, LeastSquaresResult& all) {
    const bool is_first = all.z_initial.size() == 0;
    LeastSquaresOptions rest = options;
    rest.max_iterations -= all.iterations;
    if (options.progress)
      rest.progress = [&](LeastSquaresProgress p) {
        if (!is_first && p.iteration == 0) return true;  // known from before
        p.iteration += all.iterations;
        return options.progress(p);
      };
    LeastSquaresResult found = solve_least_squares(*this, all.x, rest);
    const long failed = found.failed_evaluations;
    found.iterations += all.iterations;
    found.failed_evaluations += all.failed_evaluations;
    if (!all.first_error.empty()) found.first_error = std::move(all.first_error);
    if (!is_first) found.z_initial = std::move(all.z_initial);
    all = std::move(found);
    const bool ended = all.point.z.size() > 0 && end(all, options.tolerance);
    all.evaluations = evaluations_;
    if (all.status == SolverStatus::iteration_limit) all.end_at_limit(options.max_iterations, "iteration");
    if (!ended || all.status == SolverStatus::iteration_limit || all.status == SolverStatus::stopped) return {};
    return failed;
  }

  long evaluations() const { return evaluations_; }
  struct {
    VectorXd x;
    double cost = 0;  // without conditions
  } last;             // the last evaluation

 protected:
  // The weights of the round that begins at this point.
  virtual VectorXd weights_from(const LeastSquaresPoint& point) = 0;
  // A round to this tolerance has left this |s - P(s)|.
  virtual void settle(double, double) {}

  VectorXd residuals_of(const LeastSquaresPoint& point) const { return point.z.head(size - l_.size()); }
  VectorXd c() const { return at_x_.z.tail(l_.size()); }  // at the end of the last round
  VectorXd beyond_limits(const VectorXd& s) const { return s - s.cwiseMax(lower_).cwiseMin(upper_); }

  LeastSquaresProblem& given_;
  LeastSquaresPoint at_x_;  // of the problem given, at the end of the last round

 private:
  struct Best {
    VectorXd x, c;
    MatrixXd c_x;
    double cost = std::numeric_limits<double>::infinity();
  };
  // Turns the solution of a search into that of the given problem, without an evaluation if it is known.
  bool end(LeastSquaresResult& solution, double tolerance) {
    const Best best = std::exchange(best_, {});
    if (best.x.size() > 0 && best.x == solution.x) {
      solution.point.z.tail(l_.size()) = best.c;
      solution.point.z_x.bottomRows(l_.size()) = best.c_x;
    } else {
      solution.point.z.setZero(size);
      solution.point.z_x.setZero(size, variables());
      given_.evaluate(solution.x, solution.point);
      ++evaluations_;
      if (!solution.point.ok) return false;
    }
    x_ = solution.x;
    at_x_ = solution.point;
    const VectorXd beyond = beyond_limits(shifted(c()));
    settle(beyond.lpNorm<Eigen::Infinity>(), tolerance);
    l_ = w_.cwiseAbs2().cwiseProduct(beyond);
    w_ = weights_from(at_x_);
    VectorXd z = at_x_.z;
    z.tail(l_.size()).setZero();
    solution.cost_final = cost(z);
    return true;
  }

  VectorXd shifted(const VectorXd& c) const { return c + l_.cwiseQuotient(w_.cwiseAbs2()); }

  const VectorXd lower_, upper_;
  long evaluations_ = 0;
  VectorXd l_, w_, x_;
  Best best_;  // the best point of this round, at which most searches end
};

class EquationsRound : public MultiplierRound {
 public:
  explicit EquationsRound(LeastSquaresProblem& given)
      : MultiplierRound(given, VectorXd::Zero(given.equalities), VectorXd::Zero(given.equalities)) {}

  // |W c| divided by the norm of the residuals.
  double left() const {
    constexpr double kNoResidual = 1e-6;  // exact data: residuals are in units of their sigma
    const VectorXd w = given_.weights(at_x_.z).cwiseSqrt().head(size - W_.size());
    return W_.cwiseProduct(c()).norm() / std::max(w.cwiseProduct(residuals_of(at_x_)).norm(), kNoResidual);
  }

  // Returns whether every equation holds within its own errors.
  bool closed() const {
    return given_.closed.size() == W_.size() && (c().array().abs() <= given_.closed.array()).all();
  }

 private:
  VectorXd weights_from(const LeastSquaresPoint& point) override {
    constexpr double kFaster = 10, kHeaviest = 1e4;  // the square of the largest is far from 1/rounding
    if (W_.size() > 0) return (omega_ = std::min(kFaster * omega_, kHeaviest)) * W_;
    const Index m = given_.equalities, n = size - m;
    const VectorXd w = given_.weights(point.z).head(n).cwiseSqrt();
    const VectorXd D = (w.asDiagonal() * point.z_x.topRows(n)).colwise().norm();
    const VectorXd inverse = D.unaryExpr([](double length) { return length > 0 ? 1 / length : 0; });
    const VectorXd spread = (point.z_x.bottomRows(m) * inverse.asDiagonal()).rowwise().norm();
    return W_ = spread.unaryExpr([](double s) { return s > 0 ? 1 / s : 1; });
  }

  VectorXd W_;
  double omega_ = 1;
};

class LimitsRound : public MultiplierRound {
 public:
  using MultiplierRound::MultiplierRound;

  double left() const { return left_; }  // |s - P(s)|
  double missed() const { return beyond_limits(c()).lpNorm<Eigen::Infinity>(); }

 private:
  // Among the parts of |z| from 0.05 to 1 this one ends most runs of eighteen_points_starts.json, in the fewest
  // evaluations. With lighter limits the search passes into dead points. Heavier limits form valleys that steps follow
  // slowly.
  static constexpr double kLimitWeight = 0.15;

  VectorXd weights_from(const LeastSquaresPoint& point) override {
    constexpr double kExact = 1e-12;  // squares that vanish leave the limits a weight
    return VectorXd::Constant(size - residuals_of(point).size(), part_ * std::max(residuals_of(point).norm(), kExact));
  }

  // The weight rises if a converged round leaves more than a quarter: Nocedal and Wright, framework 17.3.
  void settle(double left, double tolerance) override {
    constexpr double kSettledRound = 1e-7, kFallenEnough = 0.25, kHeavier = 3, kHeaviest = 1e3;
    const double before = std::exchange(left_, left);
    if (tolerance < kSettledRound && left > kFallenEnough * before) part_ = std::min(kHeavier * part_, kHeaviest);
  }

  double part_ = kLimitWeight, left_ = std::numeric_limits<double>::infinity();
};

}  // namespace

LeastSquaresResult solve_with_equalities(LeastSquaresProblem& problem, const VectorXd& x_start,
                                         const LeastSquaresOptions& options) {
  constexpr double kFirstTolerance = 1e-2;       // of a round that only gives a start to the next one
  constexpr double kSatisfied = 1e-6;            // |W c| over the norm of the residuals: a millionth of their noise
  constexpr int kLooseRounds = 2, kRounds = 10;  // each lowers c by omega^2, so that three or four are usual
  if (problem.equalities == 0) return solve_least_squares(problem, x_start, options);
  EquationsRound round(problem);
  LeastSquaresResult all;
  all.x = x_start;
  for (int k = 0; k < kRounds; ++k) {
    LeastSquaresOptions of_round = options;
    if (k < kLooseRounds) of_round.tolerance = std::max(options.tolerance, std::pow(kFirstTolerance, k + 1));
    const bool goes_on = round.solve(of_round, all) && all.status != SolverStatus::failed;
    if (all.z_initial.size() > 0) all.cost_initial = problem.cost(all.z_initial);
    if (!goes_on || (round.left() <= kSatisfied && of_round.tolerance <= options.tolerance)) return all;
  }
  if (!round.closed())  // data with noise
    all.end(SolverStatus::no_progress,
            fmt::format("no further progress: the equations between the variables are not satisfied, {:.1g} of the "
                        "norm of the residuals is left of them. Tighten rtol of the integrator",
                        round.left()));
  return all;
}

LeastSquaresResult solve_within_limits(LeastSquaresProblem& problem, const VectorXd& c_lower, const VectorXd& c_upper,
                                       const VectorXd& x_start, const LeastSquaresOptions& options) {
  constexpr double kLoosest = 1e-2, kTightening = 0.03;  // tolerances of rounds that only show the next one its start
  constexpr double kLimitsHeld = 1e-6;                   // |s - P(s)| at the end: what ranks as feasible
  constexpr double kFinerLimits = 1e-4;  // of the last tolerance: the cost is stationary in x, the limits are not
  constexpr int kRounds = 30;            // seven or eight are usual
  // From the fourth round on, a round that met failed points ended in front of them if its derivatives promise so many
  // times its tolerance. If no limit is active, further rounds would not improve it.
  constexpr int kFirstJudged = 3;
  constexpr double kPromisesMore = 10;
  if (c_lower.size() == 0) return solve_least_squares(problem, x_start, options);
  LimitsRound round(problem, c_lower, c_upper);
  LeastSquaresResult all;
  all.x = x_start;
  LearntCurvature learnt(problem.variables());
  double tolerance = kLoosest, shown = 0;
  for (int k = 0; k < kRounds; ++k, tolerance *= kTightening) {
    LeastSquaresOptions of_round = options;
    of_round.large_residuals = true;
    of_round.learnt = &learnt;
    of_round.tolerance = std::max(kFinerLimits * options.tolerance, tolerance);
    if (options.max_evaluations)
      of_round.max_evaluations = std::max(1L, *options.max_evaluations - round.evaluations());
    if (options.progress)
      of_round.progress = [&](LeastSquaresProgress p) {
        if (p.x == round.last.x) shown = round.last.cost;
        p.cost = shown;
        return options.progress(p);
      };
    const std::optional<long> failed = round.solve(of_round, all);
    if (!failed) return all;
    const bool is_blocked = k >= kFirstJudged && *failed > 0 && all.promised > kPromisesMore * of_round.tolerance;
    if (is_blocked && round.left() <= kLimitsHeld) {
      all.end(SolverStatus::no_progress, "no further progress: steps lead to where evaluations fail" + all.failures());
      return all;
    }
    if (round.left() <= kLimitsHeld && of_round.tolerance <= options.tolerance) return all;
  }
  if (round.missed() > kLimitsHeld)
    all.end(SolverStatus::infeasible,
            fmt::format("no point near satisfies all limits: one is missed by {:.1g} of its size", round.missed()));
  else
    all.end(SolverStatus::no_progress, "no further progress: the multipliers of the limits do not converge");
  return all;
}

}  // namespace mbsopt::inline optim
