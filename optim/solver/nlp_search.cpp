#include "optim/solver/nlp_search.hpp"

#include <fmt/format.h>

#include <cmath>

namespace mbsopt {

bool NlpSearch::told(const NlpPoint& point, double distance) const {
  return !progress_ || progress_({result_.iterations, point.f, problem_.violation(point.c), distance, points_.x()});
}

void NlpSearch::take_solution() {
  if (points_.have_best()) result_.x = points_.best_x(), result_.point = points_.best();
  if (solution_.found()) result_.x = solution_.x(), result_.point = solution_.point();
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

}  // namespace mbsopt
