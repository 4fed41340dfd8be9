#include "optim/solver/evaluated_points.hpp"

#include <cmath>
#include <exception>
#include <limits>
#include <new>
#include <utility>

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

EvaluatedPoints::EvaluatedPoints(NonlinearProgram& problem, SolverOutcome& outcome, double constraint_tolerance,
                                 PointRecords* records)
    : problem_(problem), outcome_(outcome), constraint_tolerance_(constraint_tolerance), records_(records) {}

const NlpPoint& EvaluatedPoints::at(const Eigen::VectorXd& x_asked, Wanted wanted) {
  is_new_ = is_better_ = false;
  x_ = x_asked.cwiseMax(problem_.x_lower).cwiseMin(problem_.x_upper);
  const std::string key = bytes_of(x_);
  const auto found = kept_.find(key);
  if (found != kept_.end() &&
      (!found->second.point.ok || wanted == Wanted::values || found->second.wanted == Wanted::derivatives))
    return found->second.point;
  is_new_ = true;
  NlpPoint point = computed(wanted);
  if (point.abandoned) return abandoned_ = std::move(point);  // neither an evaluation nor a failure of x
  ++outcome_.evaluations;
  if (point.ok) {
    failed_in_a_row_ = 0;
    keep_best(point);
  } else {
    ++failed_in_a_row_;
    ++outcome_.failed_evaluations;
    last_error_ = point.message;
    if (outcome_.first_error.empty()) outcome_.first_error = point.message;
  }
  if (found == kept_.end()) order_.push_back(key);
  if (order_.size() > kRemembered) {
    kept_.erase(order_.front());
    order_.pop_front();
  }
  return (kept_[key] = {std::move(point), wanted}).point;
}

NlpPoint EvaluatedPoints::computed(Wanted wanted) {
  NlpPoint point;
  if (records_ && records_->recall(x_, wanted, point)) return point;
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
    point.ok = false, point.message = error.what();
  }
  if (point.ok && !is_finite(point, wanted))
    point.ok = false, point.message = "the objective, a constraint or a derivative is not finite";
  if (records_ && !point.abandoned) records_->record(x_, wanted, point);
  return point;
}

void EvaluatedPoints::keep_best(const NlpPoint& point) {
  const auto violations = [&](const NlpPoint& p) { return problem_.sum_of_violations(p.c, constraint_tolerance_); };
  is_better_ = !have_best_ || mbsopt::is_better(point.f, violations(point), best_.f, violations(best_));
  if (is_better_) best_x_ = x_, best_ = point, have_best_ = true;
}

}  // namespace mbsopt::inline optim
