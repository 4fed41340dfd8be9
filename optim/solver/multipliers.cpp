#include "optim/solver/multipliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The problem of one round. The last rows of z are those of the equations.
class EquationsRound : public LeastSquaresProblem {
 public:
  explicit EquationsRound(LeastSquaresProblem& given)
      : LeastSquaresProblem(given.variables(), given.size), given_(given), l_(VectorXd::Zero(given.equalities)) {
    x_lower = given.x_lower;
    x_upper = given.x_upper;
    plain = given.plain + given.equalities;
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
    if (W_.size() == 0) W_ = first_weights(point);
    const VectorXd c = point.z.tail(l_.size());
    const MatrixXd c_x = point.z_x.bottomRows(l_.size());
    point.z.tail(l_.size()) = omega_ * W_.cwiseProduct(shifted(c));
    point.z_x.bottomRows(l_.size()) = omega_ * W_.asDiagonal() * c_x;
    if (const double round_cost = cost(point.z); round_cost <= best_.cost) best_ = {x, c, c_x, round_cost};
  }

  // One search more, from all.x, with the iterations that are left. `all` becomes the result of all searches. Returns
  // whether another search can follow.
  bool solve(const LeastSquaresOptions& options, LeastSquaresResult& all) {
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
    found.iterations += all.iterations;
    found.failed_evaluations += all.failed_evaluations;
    if (!all.first_error.empty()) found.first_error = std::move(all.first_error);
    if (!is_first) found.z_initial = std::move(all.z_initial);
    all = std::move(found);
    const bool ended = all.point.z.size() > 0 && end(all);
    all.evaluations = evaluations_;
    if (all.status == SolverStatus::iteration_limit) all.end_at_limit(options.max_iterations, "iteration");
    return ended && all.status != SolverStatus::iteration_limit && all.status != SolverStatus::stopped &&
           all.status != SolverStatus::failed;
  }

  // |W c| divided by the norm of the residuals.
  double left() const {
    constexpr double kNoResidual = 1e-6;  // exact data: residuals are in units of their sigma
    const Index n = size - W_.size();
    const VectorXd w = given_.weights(at_x_.z).cwiseSqrt().head(n);
    return W_.cwiseProduct(c()).norm() / std::max(w.cwiseProduct(at_x_.z.head(n)).norm(), kNoResidual);
  }

  // Returns whether every equation holds within its own errors.
  bool closed() const {
    return given_.closed.size() == W_.size() && (c().array().abs() <= given_.closed.array()).all();
  }

 private:
  struct Best {
    VectorXd x, c;
    MatrixXd c_x;
    double cost = std::numeric_limits<double>::infinity();
  };

  VectorXd first_weights(const LeastSquaresPoint& point) const {
    const Index m = given_.equalities, n = size - m;
    const VectorXd w = given_.weights(point.z).head(n).cwiseSqrt();
    const VectorXd D = (w.asDiagonal() * point.z_x.topRows(n)).colwise().norm();
    const VectorXd inverse = D.unaryExpr([](double length) { return length > 0 ? 1 / length : 0; });
    const VectorXd spread = (point.z_x.bottomRows(m) * inverse.asDiagonal()).rowwise().norm();
    return spread.unaryExpr([](double s) { return s > 0 ? 1 / s : 1; });
  }

  // Turns the solution of a search into that of the given problem, without an evaluation if it is known.
  bool end(LeastSquaresResult& solution) {
    constexpr double kFaster = 10, kHeaviest = 1e4;  // the square of the largest is far from 1/rounding
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
    l_ = (omega_ * W_).cwiseAbs2().cwiseProduct(shifted(c()));
    omega_ = std::min(kFaster * omega_, kHeaviest);
    VectorXd z = at_x_.z;
    z.tail(l_.size()).setZero();
    solution.cost_final = cost(z);
    return true;
  }

  VectorXd c() const { return at_x_.z.tail(l_.size()); }  // at the end of the last round
  VectorXd shifted(const VectorXd& c) const { return c + l_.cwiseQuotient((omega_ * W_).cwiseAbs2()); }

  LeastSquaresProblem& given_;
  LeastSquaresPoint at_x_;  // of the problem given, at the end of the last round
  long evaluations_ = 0;
  double omega_ = 1;
  VectorXd l_, W_, x_;
  Best best_;  // the best point of this round, at which most searches end
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
    const bool goes_on = round.solve(of_round, all);
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

}  // namespace mbsopt::inline optim
