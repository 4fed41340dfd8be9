// Writes the figures of `tradeoff` to result.json, the terminal and the page.
#pragma once

#include "app/report/run_page.hpp"
#include "optim/tradeoff/advice.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {

// Adds the machine, the methods, their difference and the right values, with a warning if these are uncertain.
void show_reference(RunPage& page, const TradeoffReference& reference);
// Adds the scene's own settings and the defaults.
void show_given_settings(Run& run, const Tradeoff& tradeoff);
// Adds the errors in the sum of squares of identify, of the scene's own settings and of the defaults.
void show_fit_errors(Run& run, const FitErrors& fit);
// Adds advice per quantity, and for the task of the file, a design or an identification, if it has one.
void show_recommendations(RunPage& page, const Tradeoff& tradeoff, TaskAdviser* adviser);
void show_outcomes(Run& run, const Tradeoff& tradeoff);  // how many were measured; what was not, and why
// Adds the choice of --apply. The run fails if there is nothing to choose.
void show_applied(RunPage& page, const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit);
// Work-precision plots, and all settings.
void add_work_precision(RunPage& page, const Tradeoff& tradeoff);

}  // namespace mbsopt::inline app
