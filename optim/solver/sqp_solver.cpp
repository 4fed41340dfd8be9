#include "optim/solver/sqp_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/linear/dense.hpp"
#include "optim/solver/nlp_search.hpp"
#include "optim/solver/optimality.hpp"
#include "optim/solver/residual_curvature.hpp"
#include "optim/solver/sqp_step.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPoor = 0.25, kGood = 0.75;      // what a step gains of its promise
constexpr double kShorter = 0.35, kLonger = 2.5;  // radius after it
constexpr double kAccepted = 1e-3;                // part of the promised gain
constexpr double kFirstStep = 0.1;                // of variables of size 1, by the first curvature
constexpr double kFirstPenalty = 10;              // scaled multipliers are about 1
constexpr double kLeastPenalty = 1e-6, kLargestPenalty = 1e4;
constexpr double kSafety = 10, kFalling = 0.3;  // of the penalty above the multipliers, and from step to step
constexpr double kHeavier = 100;                // at the end, if limits cannot hold
constexpr double kHeld = 1e-8;                  // of the scaled constraints
constexpr int kMostJumps = 3;
constexpr double kNothing = 1e-13;  // a promise below it, relative to the merit, is rounding

class SqpSearch : private NlpSearch {
 public:
  SqpSearch(NonlinearProgram& problem, const SqpOptions& options, NlpResult& result)
      : NlpSearch(problem, options, result),
        options_(options),
        radius_(options.first_radius),
        rest_(problem.variables()) {
    moves_to_best_ = false;  // but to each accepted point
  }

  void run(const VectorXd& x_start) {
    result_.algorithm = "SQP: damped steps within linear limits";
    result_.x = x_start;
    point_ = at(x_start, Wanted::derivatives);
    if (!point_.ok) return point_.abandoned ? result_.end_on_request() : end_refused();
    move_to(x(), point_);
    begin();
    if (shown(look(point_))) return;
    while (true) {
      if (result_.iterations >= options_.max_iterations)
        return distance_ <= tolerance_ ? conclude({}) : end_at_limit(options_.max_iterations, "iteration");
      const bool moved = advance();
      if (is_over_) return;
      if (!moved) return jumps_ >= kMostJumps ? end_at_jump() : conclude("no step lowers the objective any more");
      ++result_.iterations;
      if (shown(distance_)) return;
    }
  }

 private:
  void end_at_limit(long most, const char* of) {
    take_solution();
    result_.end_at_limit(most, of);
  }

  // The best point that the search has moved to: others may belong to another motion.
  void end_at_jump() {
    result_.x = best_moved_x_;
    result_.point = best_moved_;
    result_.end(SolverStatus::no_progress,
                "no further progress: the objective or a limit jumps beside the last point: an assembly mode ends "
                "there, a law has a step, or modes of eigenvalues change their numbers" +
                    result_.failures());
  }

  void move_to(const VectorXd& x, const NlpPoint& point) {
    x_ = x;
    point_ = point;
    problem_.moved_to(x_);
    const auto violations = [&](const NlpPoint& p) {
      return problem_.sum_of_violations(p.c, options_.constraint_tolerance);
    };
    if (best_moved_x_.size() > 0 && !is_better(point.f, violations(point), best_moved_.f, violations(best_moved_)))
      return;
    best_moved_x_ = x;
    best_moved_ = point;
  }

  void begin() {
    const Index n = x_.size();
    const double slope = std::max(problem_.f_scale * point_.f_x.norm(), kFirstStep * kFirstStep);
    learnt_ = bfgs_ = slope / kFirstStep * MatrixXd::Identity(n, n);
    read_hessian();
  }

  // Reports the current point. Returns whether the search is over.
  bool shown(double distance) {
    if (!report(point_, distance)) {
      take_solution();
      result_.end_on_request();
      return true;
    }
    if (!was_optimal_) {
      if (distance > tolerance_ || !is_settled()) return false;
      // One step more takes what a small multiplier leaves of its limit.
      was_optimal_ = result_.iterations > 0 && (problem_.constraints() > 0 || !point_.pieces.empty());
      if (was_optimal_) return false;
    }
    conclude({});
    return true;
  }

  // Sums of squares may fall by orders of magnitude, so that the optimality at the scale of the start says little of
  // their end: they must have ceased to fall as well.
  bool is_settled() {
    constexpr double kFallen = 1e-2;  // part of f
    constexpr std::size_t kSteps = 10;
    fallen_.push_back(point_.f);
    if (given_.size() == 0 || problem_.f_scale * std::abs(point_.f) <= tolerance_) return true;
    return fallen_.size() > kSteps && fallen_[fallen_.size() - 1 - kSteps] - point_.f <= kFallen * std::abs(point_.f);
  }

  // A matrix of negative directions is no help: that of a product of parameters and sensors has some.
  void read_hessian() {
    constexpr int kMost = 3;
    given_.resize(0, 0);
    if (!options_.has_hessians || useless_ == kMost) return;
    std::vector<MatrixXd> H;
    if (problem_.hessians(x_, H) && is_usable(H[0])) {
      given_ = problem_.f_scale * H[0];
      useless_ = 0;
    } else {
      ++useless_;
    }
  }

  const MatrixXd& B() const { return uses_given_ && given_.size() > 0 ? given_ : learnt_; }
  // Whether a little damping makes a curvature positive definite.
  static bool is_usable(MatrixXd H) {
    constexpr double kNegative = 1e-2;  // of the largest curvature
    H.diagonal().array() += kNegative * std::max(H.diagonal().maxCoeff(), 0.0);
    return cholesky_factor(H).size() > 0;
  }

  double merit(const NlpPoint& p) const { return problem_.f_scale * p.f + nu_ * scaled_violation(problem_, p); }

  SqpStep damped_by(const SqpModel& model, double lambda) const {
    MatrixXd H = B();
    H.diagonal().array() += lambda;
    return model.step(H, nu_, violations_);
  }

  // The step of the least lambda that ends within the radius, or little inside of it.
  SqpStep damped_step(const SqpModel& model) {
    constexpr double kRounding = 1e-14, kFar = 1e5, kInside = 0.75, kFactor = 4;
    constexpr int kTurns = 60;
    // The part of the gradient that limits do not balance may move x by kFar radii at most: limits bring it back by
    // differences of such lengths.
    const double least = std::max(
        {kRounding * B().diagonal().maxCoeff(), unbalanced_ / (kFar * radius_), std::numeric_limits<double>::min()});
    SqpStep step = damped_by(model, least);
    if (step.ok && step.d.norm() <= radius_) return step;
    double low = least, high = 0;  // lambda of steps that are too long, and short
    double lambda = std::max(lambda_, kFactor * least);
    for (int turn = 0; turn < kTurns; ++turn) {
      step = damped_by(model, lambda);
      const double l = step.ok ? step.d.norm() : std::numeric_limits<double>::infinity();
      if (l <= radius_ && l >= kInside * radius_) break;
      if (l > radius_)
        low = lambda;
      else
        high = lambda;
      if (high > 0 && high / low < 1.05) {
        if (l > radius_) step = damped_by(model, high);
        break;
      }
      lambda = high == 0                                  ? kFactor * lambda
               : lambda == high && low < lambda / kFactor ? lambda / kFactor
                                                          : std::sqrt(low * high);
    }
    lambda_ = lambda;
    return step;
  }

  // nu rises while that lowers the violation which the linear constraints leave.
  SqpStep steered_step(const SqpModel& model) {
    constexpr double kRise = 10, kLowers = 0.9, kNone = 1e-10;
    SqpStep step = damped_step(model);
    while (step.ok && nu_ < kLargestPenalty) {
      const double left = model.violation(step.d);
      if (left <= kNone) break;
      const double nu = std::exchange(nu_, kRise * nu_);
      SqpStep more = damped_step(model);
      if (!more.ok || model.violation(more.d) > kLowers * left) {
        nu_ = nu;
        break;
      }
      step = std::move(more);
    }
    return step;
  }

  double promised(const SqpModel& model, const VectorXd& d) const {
    return nu_ * (model.violation(VectorXd::Zero(d.size())) - model.violation(d)) - model.objective(d) -
           0.5 * d.dot(B() * d);
  }

  // One accepted step. Returns false if there is none.
  bool advance() {
    const SqpModel model(problem_, x_, point_);
    unbalanced_ = std::isfinite(distance_) ? distance_ : optimality(problem_, x_, point_);
    missed_ = std::numeric_limits<double>::infinity();
    violations_ = SqpModel::Violations::of_rows;
    while (true) {
      SqpStep step = steered_step(model);
      if (!step.ok) return false;
      const double gain = promised(model, step.d), size = std::abs(merit(point_));
      if (!(gain > kNothing * size) || is_short(step.d)) {
        if (scaled_violation(problem_, point_) <= kHeld) return false;
        if (violations_ == SqpModel::Violations::of_rows) {
          violations_ = SqpModel::Violations::of_constraints;
          continue;
        }
        if (nu_ >= kLargestPenalty) return false;
        nu_ *= kHeavier;  // nothing but the violation counts any more
        continue;
      }
      const double missed_before = std::exchange(missed_, 0);
      if (is_tried(step.d, step, model, gain)) return true;
      if (is_over_) return false;
      if (gain < noise() * size || meets_jump(step.d, gain, missed_before)) return false;
      uses_given_ = prefers_given_;
      radius_ = kShorter * std::min(radius_, step.d.norm());
    }
  }

  // The merit changes by far more than the promise, and shorter steps do not help: an assembly mode ends, or a law
  // jumps. Returns whether that was seen often enough.
  bool meets_jump(const VectorXd& d, double gain, double missed_before) {
    constexpr double kShort = 0.1, kFar = 100, kFallen = 0.7;
    if (!std::isfinite(missed_) || d.norm() > kShort || missed_ < kFar * gain || missed_ < kFallen * missed_before)
      return false;
    return ++jumps_ >= kMostJumps;
  }

  bool is_short(const VectorXd& d) const {
    return d.lpNorm<Eigen::Infinity>() <= 1e-14 * std::max(1.0, x_.lpNorm<Eigen::Infinity>());
  }
  double noise() const { return 1e-2 * tolerance_ * tolerance_; }  // of the merit

  // Evaluates x + d; and once more with corrected limits, if that broke them. Returns whether one was accepted.
  bool is_tried(const VectorXd& d, const SqpStep& step, const SqpModel& model, double gain) {
    const NlpPoint there = evaluated(d);
    if (is_over_) return false;
    double gained = there.ok ? merit(point_) - merit(there) : -std::numeric_limits<double>::infinity();
    if (std::isfinite(gained)) missed_ = gain - gained;
    if (there.ok) judge_curvatures(d, gain, gained);
    if (gained >= kAccepted * gain) return accept(d, there, step, model, gain, gained);
    if (!there.ok || scaled_violation(problem_, there) <= model.violation(d)) return false;
    SqpModel corrected = model;
    corrected.correct(problem_, d, there);
    const SqpStep second = damped_step(corrected);
    if (!second.ok || (second.d - d).norm() > d.norm()) return false;
    const NlpPoint then = evaluated(second.d);
    if (is_over_ || !then.ok) return false;
    gained = merit(point_) - merit(then);
    return gained >= kAccepted * gain && accept(second.d, then, second, model, gain, gained);
  }

  NlpPoint evaluated(const VectorXd& d) {
    if (options_.max_evaluations && result_.evaluations >= *options_.max_evaluations) {
      is_over_ = true;
      end_at_limit(*options_.max_evaluations, "evaluation");
      return {};
    }
    const NlpPoint there = at(x_ + d, Wanted::derivatives);
    if (there.abandoned) {
      is_over_ = true;
      take_solution();
      result_.end_on_request();
    } else if (there.ok) {
      distance_ = look(there);
    }
    return there;
  }

  // The curvature that foretold this change better takes part in the next step.
  void judge_curvatures(const VectorXd& d, double gain, double gained) {
    if (given_.size() == 0) return;
    const double by_given = gain + 0.5 * d.dot((B() - given_) * d), by_learnt = gain + 0.5 * d.dot((B() - learnt_) * d);
    prefers_given_ = !has_learnt_ || !is_usable(learnt_) || std::abs(by_given - gained) <= std::abs(by_learnt - gained);
  }

  bool accept(const VectorXd& d, const NlpPoint& there, const SqpStep& step, const SqpModel& model, double gain,
              double gained) {
    const VectorXd bend = bend_of_lagrangian(there, step, model), s = x() - x_;  // x(): of the last evaluation
    const double ratio = gained / gain;
    if (ratio < kPoor) radius_ = kShorter * d.norm();
    // The violation of limits that bend is no reason for shorter steps: a second step corrects it.
    const double bent = std::max(0.0, nu_ * (scaled_violation(problem_, there) - model.violation(d)));
    if (gained + bent > kGood * gain) radius_ = std::max(radius_, kLonger * d.norm());
    move_to((x_ + d).cwiseMax(problem_.x_lower).cwiseMin(problem_.x_upper), there);
    read_hessian();
    learn(s, bend);
    uses_given_ = prefers_given_ || !is_usable(learnt_);
    // Penalties far above the multipliers let no step leave limits that bend.
    double most = 0;
    for (std::size_t j = 0; j < model.rows.size(); ++j)
      if (model.rows[j].row >= 0) most = std::max(most, std::abs(step.y(static_cast<Index>(j))));
    nu_ = std::clamp(std::max(kSafety * most, kFalling * nu_), kLeastPenalty, kLargestPenalty);
    return true;
  }

  // The gradient of the Lagrangian of the step's multipliers at another point, less that of the model.
  VectorXd bend_of_lagrangian(const NlpPoint& there, const SqpStep& step, const SqpModel& model) const {
    VectorXd change = problem_.f_scale * (there.f_x - point_.f_x);
    const auto without_extremes = [&](const NlpPoint& p, double sign) {
      std::vector<Index> seen;
      for (const NlpPiece& piece : p.pieces)
        if (piece.row < 0 && std::ranges::find(seen, piece.row) == seen.end()) {
          seen.push_back(piece.row);
          change -= sign * problem_.f_scale * piece.gradient;
        }
    };
    without_extremes(there, 1);
    without_extremes(point_, -1);
    for (std::size_t j = 0; j < model.rows.size(); ++j) {
      const SqpRow& row = model.rows[j];
      const double y = step.y(static_cast<Index>(j));
      if (y == 0) continue;
      const double scale = row.row < 0 ? problem_.f_scale : row.sign * problem_.c_scale(row.row);
      change += y * (scale * gradient_of(row, there) - row.a);
    }
    return change;
  }

  // Returns the gradient at another point of the function that this row was of.
  VectorXd gradient_of(const SqpRow& row, const NlpPoint& there) const {
    const NlpPiece* nearest = nullptr;
    if (row.piece >= 0) {
      const NlpPiece& here = point_.pieces[static_cast<std::size_t>(row.piece)];
      for (const NlpPiece& piece : there.pieces)
        if (piece.row == here.row && piece.side == here.side &&
            (!nearest || std::abs(piece.mark - here.mark) < std::abs(nearest->mark - here.mark)))
          nearest = &piece;
    }
    if (nearest) return nearest->gradient;
    return row.row < 0 ? there.f_x : VectorXd(there.c_x.row(row.row).transpose());
  }

  void learn(const VectorXd& s, const VectorXd& y) {
    update_bfgs(s, y);
    learnt_ = bfgs_;
    if (given_.size() > 0) {
      rest_.add(s, y, y - given_ * s);
      learnt_ = given_ + rest_.matrix();
    }
    has_learnt_ = true;
  }

  // Damped BFGS: Nocedal and Wright, procedure 18.2. The first step tells the size of the curvature.
  void update_bfgs(const VectorXd& s, VectorXd y) {
    constexpr double kDamped = 0.2;
    const double rise = s.dot(y), square = s.squaredNorm();
    if (square == 0) return;
    if (!has_learnt_ && rise > 0) bfgs_ = y.squaredNorm() / rise * MatrixXd::Identity(s.size(), s.size());
    const VectorXd Bs = bfgs_ * s;
    const double sBs = s.dot(Bs);
    if (!(sBs > 0)) return;
    if (rise < kDamped * sBs) {
      const double theta = (1 - kDamped) * sBs / (sBs - rise);
      y = theta * y + (1 - theta) * Bs;
    }
    bfgs_ += y * y.transpose() / s.dot(y) - Bs * Bs.transpose() / sBs;
  }

  const SqpOptions& options_;
  VectorXd x_, best_moved_x_;
  NlpPoint point_, best_moved_;
  std::vector<double> fallen_;  // f, point by point, since the optimality conditions hold
  double unbalanced_ = 0;       // optimality of the point, feasible or not
  double missed_ = 0;           // by the promise of the last step
  int jumps_ = 0;
  SqpModel::Violations violations_ = SqpModel::Violations::of_rows;
  double lambda_ = 1e-3, radius_, nu_ = kFirstPenalty, distance_ = std::numeric_limits<double>::infinity();
  MatrixXd given_, learnt_, bfgs_;  // given: empty where it is not known or no help
  int useless_ = 0;                 // given ones in a row
  ResidualCurvature rest_;
  bool uses_given_ = true, prefers_given_ = true, has_learnt_ = false, is_over_ = false, was_optimal_ = false;
};

}  // namespace

NlpResult solve_with_sqp(NonlinearProgram& problem, const VectorXd& x_start, const SqpOptions& options) {
  NlpResult result;
  SqpSearch(problem, options, result).run(x_start);
  return result;
}

}  // namespace mbsopt::inline optim
