#include "optim/solver/limit_multipliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// The weight as part of |z|. Among the values from 0.05 to 1 it ends most runs of eighteen_points_starts.json, in the
// fewest evaluations. With lighter limits the search passes into dead points. Heavier limits form valleys that
// steps follow slowly.
constexpr double kLimitWeight = 0.15;
// The weight rises if a converged round leaves more than a quarter of |c - P(s)|: Nocedal and Wright, framework 17.3.
constexpr double kSettledRound = 1e-7, kFallenEnough = 0.25, kHeavierLimit = 3, kHeaviestLimit = 1e3;
constexpr double kLoosest = 1e-2,
                 kTightening = 0.03;   // tolerances of rounds that only show the next one where to start
constexpr double kLimitsHeld = 1e-6;   // |c - P(s)| at the end: what ranks as feasible
constexpr double kFinerLimits = 1e-4;  // of the last tolerance: the cost is stationary in x, the limits are not
constexpr int kLimitRounds = 30;       // seven or eight are usual
// From the fourth round on, a round that met failed points ended in front of them if its derivatives promise so many
// times its tolerance. If no limit is active, further rounds would not improve it.
constexpr int kFirstJudged = 3;
constexpr double kPromisesMore = 10;

class LimitRound : public LeastSquaresProblem {
 public:
  LimitRound(LeastSquaresProblem& given, const VectorXd& c_lower, const VectorXd& c_upper)
      : LeastSquaresProblem(given.variables(), given.size),
        given_(given),
        c_lower_(c_lower),
        c_upper_(c_upper),
        l_(VectorXd::Zero(c_lower.size())) {
    x_lower = given.x_lower, x_upper = given.x_upper;
  }

  void evaluate(const VectorXd& x, LeastSquaresPoint& point) override {
    if (known_.z.size() > 0 && x == x_) {  // the end of the last round
      point = known_;
    } else {
      ++evaluations;
      given_.evaluate(x, point);
      is_integrated = given_.is_integrated;
      if (!point.ok) return;
    }
    last = {x, 0.5 * point.z.head(size - l_.size()).squaredNorm()};
    if (w_ == 0) w_ = weight(point);
    LeastSquaresPoint given = point;
    const VectorXd s = point.z.tail(l_.size()) + l_ / (w_ * w_), beyond = s - taken_in(s);
    point.z.tail(l_.size()) = w_ * beyond;
    for (Index i = 0; i < l_.size(); ++i) point.z_x.row(point.z.size() - l_.size() + i) *= beyond(i) != 0 ? w_ : 0;
    if (const double cost = point.z.squaredNorm(); cost <= best_.cost) best_ = {x, std::move(given), cost};
  }

  // Turns the solution of a round into that of the given problem, without an evaluation if it is known.
  bool end(LeastSquaresResult& solution, double tolerance) {
    Evaluated at_best = std::exchange(best_, {});
    LeastSquaresPoint& at = at_best.point;
    if (at_best.x.size() == 0 || at_best.x != solution.x) {
      at.z.setZero(size), at.z_x.setZero(size, variables());
      given_.evaluate(solution.x, at);
      ++evaluations;
      if (!at.ok) return false;
    }
    const VectorXd c = at.z.tail(l_.size()), s = c + l_ / (w_ * w_);
    const double before = std::exchange(left_, (c - taken_in(s)).lpNorm<Eigen::Infinity>());
    if (tolerance < kSettledRound && left_ > kFallenEnough * before)
      part_ = std::min(kHeavierLimit * part_, kHeaviestLimit);
    missed_ = (c - taken_in(c)).lpNorm<Eigen::Infinity>();
    l_ = w_ * w_ * (s - taken_in(s));
    x_ = solution.x, known_ = at, w_ = weight(at);
    solution.point = at, solution.cost_final = 0.5 * at.z.head(size - l_.size()).squaredNorm();
    return true;
  }

  double left() const { return left_; }      // |c - P(s)|
  double missed() const { return missed_; }  // |c - P(c)|
  long evaluations = 0;
  struct {
    VectorXd x;
    double cost = 0;  // without limits
  } last;             // the last evaluation

 private:
  struct Evaluated {
    VectorXd x;
    LeastSquaresPoint point;  // of the problem given
    double cost = std::numeric_limits<double>::infinity();
  };

  VectorXd taken_in(const VectorXd& c) const { return c.cwiseMax(c_lower_).cwiseMin(c_upper_); }
  double weight(const LeastSquaresPoint& point) const {
    constexpr double kExact = 1e-12;  // squares that vanish leave the limits a weight
    return part_ * std::max(point.z.head(size - l_.size()).norm(), kExact);
  }

  LeastSquaresProblem& given_;
  const VectorXd &c_lower_, &c_upper_;
  Evaluated best_;  // the best point of this round, at which most searches end
  VectorXd l_, x_;
  double part_ = kLimitWeight, w_ = 0, left_ = std::numeric_limits<double>::infinity(), missed_ = 0;
  LeastSquaresPoint known_;
};

}  // namespace

LeastSquaresResult solve_within_limits(LeastSquaresProblem& problem, const VectorXd& c_lower, const VectorXd& c_upper,
                                       const VectorXd& x_start, const LeastSquaresOptions& options) {
  if (c_lower.size() == 0) return solve_least_squares(problem, x_start, options);
  LimitRound round(problem, c_lower, c_upper);
  LeastSquaresResult all;
  all.x = x_start;
  LearntCurvature learnt(problem.variables());
  double tolerance = kLoosest, shown = 0;
  for (int k = 0; k < kLimitRounds; ++k, tolerance *= kTightening) {
    LeastSquaresOptions of_round = options;
    of_round.large_residuals = true, of_round.learnt = &learnt;
    of_round.tolerance = std::max(kFinerLimits * options.tolerance, tolerance);
    if (options.max_evaluations) of_round.max_evaluations = std::max(1L, *options.max_evaluations - round.evaluations);
    if (options.progress)
      of_round.progress = [&](LeastSquaresProgress p) {
        if (p.x == round.last.x) shown = round.last.cost;
        p.cost = shown;
        return options.progress(p);
      };
    const long failed = search_on(round, of_round, all);
    const bool is_blocked = k >= kFirstJudged && failed > 0 && all.promised > kPromisesMore * of_round.tolerance;
    all.evaluations = round.evaluations;
    if (all.point.z.size() == 0 || !round.end(all, of_round.tolerance)) return all;
    all.evaluations = round.evaluations;
    if (all.status == SolverStatus::iteration_limit) all.end_at_limit(options.max_iterations, "iteration");
    if (all.status == SolverStatus::iteration_limit || all.status == SolverStatus::stopped) return all;
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
