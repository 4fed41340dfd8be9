#include "optim/solver/nlp_search.hpp"

#include <fmt/format.h>

#include <cmath>

#include "optim/solver/optimality.hpp"

namespace mbsopt::inline optim {

double NlpSearch::look(const NlpPoint& point) {
  if (!points_.feasible(point) || !as_good_as_best(point.f)) return std::numeric_limits<double>::infinity();
  const double distance = optimality(problem_, points_.x(), point);
  if (!has_solution() || distance < distance_) solution_x_ = points_.x(), solution_ = point, distance_ = distance;
  return distance;
}

bool NlpSearch::report(const NlpPoint& point, double distance) const {
  return !progress_ || progress_({result_.iterations, point.f, problem_.violation(point.c), distance, points_.x()});
}

void NlpSearch::take_solution() {
  if (points_.have_best()) result_.x = points_.best_x(), result_.point = points_.best();
  if (has_solution()) result_.x = solution_x_, result_.point = solution_;
}

void NlpSearch::end_refused() {
  result_.refuse_start(result_.first_error);
  result_.point.ok = false;
}

void NlpSearch::end_optimal() { result_.end(SolverStatus::converged, "converged: the optimality conditions hold"); }

void NlpSearch::end_start_optimal() { result_.end(SolverStatus::converged, "converged: the start is optimal already"); }

void NlpSearch::end_infeasible() {
  result_.end(SolverStatus::infeasible,
              "infeasible: no point near the last one satisfies the constraints; relax them or start elsewhere" +
                  result_.failures());
}

void NlpSearch::end_settled(double distance, const std::string& why) {
  if (distance <= kAcceptable * tolerance_)
    return result_.end(SolverStatus::converged,
                       "converged: the objective does not change any more, and the optimality conditions hold to the "
                       "accuracy of its derivatives");
  const std::string held = std::isnan(distance) ? "do not hold" : fmt::format("hold to {:.1e} only, not", distance);
  result_.end(SolverStatus::no_progress,
              fmt::format("no further progress: {}, but the optimality conditions {} to {:g}; try tighter simulation "
                          "tolerances, or a larger optimiser tolerance{}",
                          why, held, tolerance_, result_.failures()));
}

}  // namespace mbsopt::inline optim
