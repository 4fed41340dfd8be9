// The results of `tradeoff`, into result.json and onto standard output.
#pragma once

#include <string>

#include "app/run/run.hpp"
#include "optim/tradeoff/penalty_study.hpp"
#include "optim/tradeoff/task_advice.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt {

std::string duration_text(double seconds);  // "12.3 ms", "1.5 s"
// Per quantity, by name; those that are not known are left out.
Json errors_json(const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors);

// The methods, what they are apart, the right values; a warning where these are not certain.
void add_reference(Run& run, const TradeoffReference& reference);
// The scene's own settings and the defaults.
void add_given_settings(Run& run, const Tradeoff& tradeoff);
void add_fit_errors(Run& run, const FitErrors& errors);
void add_recommendations(Run& run, const Tradeoff& tradeoff);
// For what the file is made for, a design or an identification.
void add_task_recommendations(Run& run, const Tradeoff& tradeoff, TaskAdviser& adviser);
void add_outcomes(Run& run, const Tradeoff& tradeoff);  // how many were measured; what was not, and why
// The choice of --apply; the run has failed where there is nothing to choose.
void add_applied(Run& run, const Tradeoff& tradeoff, const TaskAdvice& advice);

void add_penalty_study(Run& run, const PenaltyStudy& study);

}  // namespace mbsopt
