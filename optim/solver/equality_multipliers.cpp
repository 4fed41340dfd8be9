#include "optim/solver/equality_multipliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kFaster = 10, kHeaviest = 1e4;  // omega; the square of the largest is far from 1/rounding
constexpr double kFirstTolerance = 1e-2;         // tolerance of a round that only gives a start to the next one
constexpr double kSatisfied = 1e-6;              // |W c| over the norm of the residuals: a millionth of their noise
constexpr int kLooseRounds = 2;
constexpr int kRounds = 10;  // each lowers c by omega^2, so that three or four are usual

class Round : public LeastSquaresProblem {
 public:
  explicit Round(LeastSquaresProblem& given)
      : LeastSquaresProblem(given.variables(), given.size), given_(given), lambda_(VectorXd::Zero(given.equalities)) {
    x_lower = given.x_lower, x_upper = given.x_upper;
    plain = given.plain + given.equalities;
    loss = given.loss, groups = given.groups, parts = given.parts;
  }

  void evaluate(const VectorXd& x, LeastSquaresPoint& point) override {
    if (x_.size() > 0 && x == x_) {  // the end of the last round
      point = at_x_;
    } else {
      ++evaluations;
      given_.evaluate(x, point);
      if (!point.ok) return;
      if (W_.size() == 0) W_ = weights_of_equations(point);
    }
    const VectorXd Omega = omega_ * W_;
    point.z.tail(W_.size()) = Omega.cwiseProduct(point.z.tail(W_.size())) + lambda_.cwiseQuotient(Omega);
    point.z_x.bottomRows(W_.size()).array().colwise() *= Omega.array();
  }

  // Turns the solution of a round into that of the given problem.
  void end(LeastSquaresResult& solution) {
    const VectorXd Omega = omega_ * W_;
    auto c = solution.point.z.tail(W_.size());
    const VectorXd lambda = Omega.cwiseProduct(c);
    c = (c - lambda_.cwiseQuotient(Omega)).cwiseQuotient(Omega).eval();
    solution.point.z_x.bottomRows(W_.size()).array().colwise() /= Omega.array();
    lambda_ = lambda, x_ = solution.x, at_x_ = solution.point;
    omega_ = std::min(kFaster * omega_, kHeaviest);
    solution.cost_final = given_.cost(solution.point.z);
  }

  // |W c| divided by the norm of the residuals.
  double left() const {
    const VectorXd z = given_.weights(at_x_.z).cwiseSqrt().cwiseProduct(at_x_.z).head(size - W_.size());
    return W_.cwiseProduct(at_x_.z.tail(W_.size())).norm() / std::max(z.norm(), kNoResidual);
  }

  // Returns whether every equation holds within its own errors.
  bool closed() const {
    const Eigen::ArrayXd c = at_x_.z.tail(W_.size()).array().abs();
    return given_.closed.size() == c.size() && (c <= given_.closed.array()).all();
  }

  long evaluations = 0;

 private:
  static constexpr double kNoResidual = 1e-6;  // exact data: residuals are in units of their sigma

  VectorXd weights_of_equations(const LeastSquaresPoint& point) const {
    const Index m = given_.equalities, n = size - m;
    const VectorXd w = given_.weights(point.z).head(n).cwiseSqrt();
    const VectorXd D = (w.asDiagonal() * point.z_x.topRows(n)).colwise().norm();
    const VectorXd inverse = D.unaryExpr([](double length) { return length > 0 ? 1 / length : 0; });
    const VectorXd spread = (point.z_x.bottomRows(m) * inverse.asDiagonal()).rowwise().norm();
    return spread.unaryExpr([](double s) { return s > 0 ? 1 / s : 1; });
  }

  LeastSquaresProblem& given_;
  VectorXd lambda_, W_;
  double omega_ = 1;
  VectorXd x_;
  LeastSquaresPoint at_x_;
};

bool ends_search(SolverStatus status) {
  return status != SolverStatus::converged && status != SolverStatus::no_progress;
}

}  // namespace

LeastSquaresResult solve_with_equalities(LeastSquaresProblem& problem, const VectorXd& x_start,
                                         const LeastSquaresOptions& options) {
  if (problem.equalities == 0) return solve_least_squares(problem, x_start, options);
  Round round(problem);
  LeastSquaresResult all;
  all.x = x_start;
  for (int k = 0; k < kRounds; ++k) {
    LeastSquaresOptions of_round = options;
    if (k < kLooseRounds) of_round.tolerance = std::max(options.tolerance, std::pow(kFirstTolerance, k + 1));
    search_on(round, of_round, all);
    all.evaluations = round.evaluations;
    if (all.point.z.size() == 0) return all;
    if (all.status == SolverStatus::iteration_limit) all.end_at_limit(options.max_iterations, "iteration");
    round.end(all);
    all.cost_initial = problem.cost(all.z_initial);
    const bool satisfied = round.left() <= kSatisfied;
    if (ends_search(all.status) || (satisfied && of_round.tolerance <= options.tolerance)) return all;
  }
  if (round.closed()) return all;  // data without noise
  all.status = SolverStatus::no_progress;
  all.message = fmt::format(
      "no further progress: the equations between the variables are not satisfied, {:.1g} of the norm of the residuals "
      "is left of them. Tighten rtol of the integrator",
      round.left());
  return all;
}

}  // namespace mbsopt::inline optim
