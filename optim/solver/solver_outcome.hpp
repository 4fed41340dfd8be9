// The end of any solver on any problem.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace mbsopt::inline optim {

// searched: a global method has used up its budget, which is its only end. converged_beyond_limit: limits hold for
// smooth extremes, but not for the true ones.
enum class SolverStatus {
  converged,
  converged_beyond_limit,
  searched,
  no_progress,
  iteration_limit,
  infeasible,
  stopped,
  failed
};
std::string_view to_string(SolverStatus status);  // in this order: "converged", "no_progress", "iteration_limit", ...

struct SolverOutcome {
  SolverStatus status = SolverStatus::failed;
  std::string message;  // in words, always
  Eigen::VectorXd x;    // the solution, or the best point seen
  int iterations = 0;
  long evaluations = 0, failed_evaluations = 0;
  std::string first_error;  // of the first evaluation that failed

  std::string failures() const;  // "; 2 of 17 evaluations failed, first: ...", or ""

  void take_counts(const SolverOutcome& of);  // of iterations and evaluations

  void end(SolverStatus how, std::string words);
  void end_on_request();
  void end_at_limit(long most, std::string_view of);  // of: "iteration"
  void refuse_start(const std::string& why);
};

}  // namespace mbsopt::inline optim
