// The results of `tradeoff`, into result.json and onto standard output.
#pragma once

#include <string>

#include "app/run/run.hpp"
#include "optim/tradeoff/advice.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {

std::string duration_text(double seconds);  // "12.3 ms", "1.5 s"
// "1.2e-04", "-" of an error that is not there; "< 4.3e-06" below what the reference is certain of.
std::string error_text(double error, double certificate = 0);
// Errors per quantity, by name; unknown ones are left out.
Json errors_json(const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors);

// Adds the methods, their difference and the right values, with a warning if these are uncertain.
void add_reference(Run& run, const TradeoffReference& reference);
// Adds the scene's own settings and the defaults.
void add_given_settings(Run& run, const Tradeoff& tradeoff);
// Adds the errors in the sum of squares of identify, of the scene's own settings and of the defaults.
void add_fit_errors(Run& run, const FitErrors& fit);
void add_recommendations(Run& run, const Tradeoff& tradeoff);
// Adds recommendations for the task of the file, a design or an identification.
void add_task_recommendations(Run& run, const Tradeoff& tradeoff, TaskAdviser& adviser);
void add_outcomes(Run& run, const Tradeoff& tradeoff);  // how many were measured; what was not, and why
// Adds the choice of --apply. The run fails if there is nothing to choose.
void add_applied(Run& run, const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit);

void add_penalty_study(Run& run, const PenaltyStudy& study);

}  // namespace mbsopt::inline app
