// The results of an identification, for people on standard output and for scripts in result.json and CSV files.
#pragma once

#include <string>

#include "app/results/trajectory_csv.hpp"
#include "app/run/run.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/recovery.hpp"

namespace mbsopt::inline app {

// These print their argument, and add it to the result of the run. Before the fit: what the data would determine at the
// start with the given sigmas. After it: fits of simulated records, and of resampled residuals.
void show_preflight(Run& run, const IdentificationResult& start);
void show_recovery(Run& run, const Recovery& recovery);
void show_bootstrap(Run& run, const IdentificationResult& fit, const Recovery& bootstrap);

// "the data determine 4 combinations of 4 parameters: singular values 1.8, 0.807, 0.335, 0.0239; the effects of c and T
// cancel but for 0.024". With continuity it is "7 of the 7 combinations that continuity leaves of 13 parameters".
std::string determined_in_words(const IdentificationResult& fit);

// parameters, correlation, covariance, experiments, optimizer, statistics, identifiability, profiles
void add_to_result(Json& result, const IdentificationResult& fit);

Trajectory history_of(const IdentificationResult& fit);      // history.csv
std::string residuals_csv(const IdentificationResult& fit);  // a row per sample
std::string profile_csv(const IdentificationResult& fit);    // a row per point of a profile

}  // namespace mbsopt::inline app
