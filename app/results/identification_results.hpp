// The results of an identification, for people on standard output and for scripts in result.json and CSV files.
#pragma once

#include <string>

#include "app/results/trajectory_csv.hpp"
#include "app/run/run.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/recovery.hpp"

namespace mbsopt::inline app {

// These print their argument, and add it to the result of the run. Before the fit: what the data would determine at the
// start with the given sigmas. After it: fits of simulated records.
void show_preflight(Run& run, const IdentificationResult& start);
void show_recovery(Run& run, const Recovery& recovery);

// parameters, correlation, covariance, experiments, optimizer, statistics, identifiability
void add_to_result(Json& result, const IdentificationResult& fit);

Trajectory history_of(const IdentificationResult& fit);      // history.csv
std::string residuals_csv(const IdentificationResult& fit);  // a row per sample

}  // namespace mbsopt::inline app
