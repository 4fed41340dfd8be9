#include "optim/solver/nlp_search.hpp"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <new>
#include <utility>

#include "optim/solver/optimality.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr std::size_t kRemembered = 1000;  // points; solvers go back to recent ones only

std::string bytes_of(const Eigen::VectorXd& x) {
  const Eigen::VectorXd plain = x.array() + 0.0;  // -0 is 0
  return {reinterpret_cast<const char*>(plain.data()), static_cast<std::size_t>(plain.size()) * sizeof(double)};
}

bool is_finite(const NlpPoint& p, Wanted wanted) {
  if (!std::isfinite(p.f) || !p.c.allFinite()) return false;
  return wanted == Wanted::values || (p.f_x.allFinite() && p.c_x.allFinite());
}

}  // namespace

bool is_better(double f, double violations, double than_f, double than_violations) {
  if (than_violations == 0) return violations == 0 && f < than_f;
  return violations < than_violations;
}

Eigen::VectorXd near_bounds(const Eigen::VectorXd& bounds, const Eigen::VectorXd& x) {
  constexpr double kFar = 1e3;
  return bounds.binaryExpr(x, [](double bound, double from) {
    return std::abs(bound - from) > kFar ? std::copysign(std::numeric_limits<double>::infinity(), bound - from) : bound;
  });
}

const NlpPoint& NlpSearch::at(const Eigen::VectorXd& x_asked, Wanted wanted) {
  is_new_ = is_best_ = false;
  x_ = x_asked.cwiseMax(problem_.x_lower).cwiseMin(problem_.x_upper);
  const std::string key = bytes_of(x_);
  const auto found = kept_.find(key);
  if (found != kept_.end() &&
      (!found->second.point.ok || wanted == Wanted::values || found->second.wanted == Wanted::derivatives))
    return found->second.point;
  is_new_ = true;
  NlpPoint point = computed(wanted);
  if (point.abandoned) return abandoned_ = std::move(point);  // neither an evaluation nor a failure of x
  ++result_.evaluations;
  if (point.ok) {
    failed_in_a_row_ = 0;
    keep_best(point);
  } else {
    ++failed_in_a_row_;
    ++result_.failed_evaluations;
    last_error_ = point.message;
    if (result_.first_error.empty()) result_.first_error = point.message;
  }
  if (found == kept_.end()) order_.push_back(key);
  if (order_.size() > kRemembered) {
    kept_.erase(order_.front());
    order_.pop_front();
  }
  return (kept_[key] = {std::move(point), wanted}).point;
}

NlpPoint NlpSearch::computed(Wanted wanted) {
  NlpPoint point;
  point.c.setZero(problem_.constraints());
  if (wanted == Wanted::derivatives) {
    point.f_x.setZero(x_.size());
    point.c_x.setZero(problem_.constraints(), x_.size());
  }
  try {
    wanted == Wanted::derivatives ? problem_.evaluate(x_, point) : problem_.evaluate_values(x_, point);
  } catch (const std::bad_alloc&) {
    throw;  // says nothing about the point, and must not be remembered of it
  } catch (const std::exception& error) {
    point.ok = false;
    point.message = error.what();
  }
  if (point.ok && !is_finite(point, wanted)) {
    point.ok = false;
    point.message = "the objective, a constraint or a derivative is not finite";
  }
  return point;
}

void NlpSearch::keep_best(const NlpPoint& point) {
  const auto violations = [&](const NlpPoint& p) { return problem_.sum_of_violations(p.c, constraint_tolerance_); };
  is_best_ = best_x_.size() == 0 || mbsopt::is_better(point.f, violations(point), best_.f, violations(best_));
  if (is_best_) {
    best_x_ = x_;
    best_ = point;
    if (moves_to_best_) problem_.moved_to(x_);
  }
}

double NlpSearch::look(const NlpPoint& point) {
  if (!feasible(point) || !as_good_as_best(point.f)) return std::numeric_limits<double>::infinity();
  const double distance = optimality(problem_, x_, point);
  if (!has_solution() || distance < distance_) {
    solution_x_ = x_;
    solution_ = point;
    distance_ = distance;
  }
  return distance;
}

bool NlpSearch::report(const NlpPoint& point, double distance) const {
  return !progress_ || progress_({result_.iterations, point.f, problem_.violation(point.c), distance, x_});
}

void NlpSearch::take_solution() {
  if (best_x_.size() > 0) {
    result_.x = best_x_;
    result_.point = best_;
  }
  if (has_solution()) {
    result_.x = solution_x_;
    result_.point = solution_;
  }
}

void NlpSearch::end_refused() {
  result_.refuse_start(result_.first_error);
  result_.point.ok = false;
}

void NlpSearch::conclude(const std::string& why) {
  constexpr double kHeldAtLast = 1e-6;  // of a limit's size: where limits leave no room, steps may come no nearer
  take_solution();
  if (problem_.violation(result_.point.c) > std::max(constraint_tolerance_, kHeldAtLast))
    return result_.end(SolverStatus::infeasible,
                       "infeasible: no point near the last one satisfies the constraints; relax them or start "
                       "elsewhere" +
                           result_.failures());
  const double distance = optimality(problem_, result_.x, result_.point);
  if (distance <= tolerance_)
    return result_.end(SolverStatus::converged, result_.evaluations == 1
                                                    ? "converged: the optimality conditions hold where the search began"
                                                    : "converged: the optimality conditions hold");
  if (distance <= kAcceptable * tolerance_)
    return result_.end(SolverStatus::converged,
                       "converged: the objective does not change any more, and the optimality conditions hold to the "
                       "accuracy of its derivatives");
  result_.end(SolverStatus::no_progress,
              fmt::format("no further progress: {}, but the optimality conditions hold to {:.1e} only, not to {:g}{}",
                          why, distance, tolerance_, result_.failures()));
}

}  // namespace mbsopt::inline optim
