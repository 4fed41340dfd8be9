#include "optim/solver/solver_outcome.hpp"

#include <fmt/format.h>

namespace mbsopt {

std::string_view to_string(SolverStatus status) {
  switch (status) {
    case SolverStatus::converged:
      return "converged";
    case SolverStatus::converged_beyond_limit:
      return "converged_beyond_limit";
    case SolverStatus::searched:
      return "searched";
    case SolverStatus::no_progress:
      return "no_progress";
    case SolverStatus::iteration_limit:
      return "iteration_limit";
    case SolverStatus::infeasible:
      return "infeasible";
    case SolverStatus::stopped:
      return "stopped";
    case SolverStatus::failed:
      break;
  }
  return "failed";
}

std::string SolverOutcome::failures() const {
  if (failed_evaluations == 0) return {};
  return fmt::format("; {} of {} evaluations failed, first: {}", failed_evaluations, evaluations, first_error);
}

}  // namespace mbsopt
