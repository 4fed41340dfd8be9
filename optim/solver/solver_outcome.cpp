#include "optim/solver/solver_outcome.hpp"

#include <fmt/format.h>

#include <utility>

#include "core/expression/counted.hpp"

namespace mbsopt::inline optim {

std::string_view to_string(SolverStatus status) {
  constexpr std::string_view kNames[] = {
      "converged", "converged_beyond_limit", "searched", "no_progress", "iteration_limit", "infeasible", "stopped",
      "failed"};
  return kNames[static_cast<std::size_t>(status)];
}

std::string SolverOutcome::failures() const {
  if (failed_evaluations == 0) return {};
  return fmt::format("; {} of {} evaluations failed, first: {}", failed_evaluations, evaluations, first_error);
}

void SolverOutcome::take_counts(const SolverOutcome& of) {
  iterations = of.iterations;
  evaluations = of.evaluations;
  failed_evaluations = of.failed_evaluations;
}

void SolverOutcome::end(SolverStatus how, std::string words) { status = how, message = std::move(words); }

void SolverOutcome::end_on_request() { end(SolverStatus::stopped, "stopped on request"); }

void SolverOutcome::end_at_limit(long most, std::string_view of) {
  end(SolverStatus::iteration_limit, fmt::format("stopped at the limit of {}{}", counted(most, of), failures()));
}

void SolverOutcome::refuse_start(const std::string& why) {
  end(SolverStatus::failed, "the start point cannot be evaluated: " + why);
}

}  // namespace mbsopt::inline optim
