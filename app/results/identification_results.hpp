// The results of an identification, for people on standard output and for scripts in result.json and CSV files.
#pragma once

#include <ostream>
#include <string>

#include "app/files/result_json.hpp"
#include "app/results/trajectory_csv.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/recovery.hpp"

namespace mbsopt::inline app {

// The report before the fit: what the data would determine at the start with the given sigmas.
void print_preflight(std::ostream& out, const IdentificationResult& start);
void add_preflight(Json& result, const IdentificationResult& start);  // preflight.parameters; identifiability

// effort is the text of effort() in multistart.hpp.
void print_fit(std::ostream& out, const IdentificationResult& fit, const std::string& effort);
void print_recovery(std::ostream& out, const Recovery& recovery);
void add_to_result(Json& result, const Recovery& recovery);
void print_bootstrap(std::ostream& out, const IdentificationResult& fit, const Recovery& bootstrap);
void add_bootstrap(Json& result, const Recovery& bootstrap);
// parameters, correlation, covariance, experiments, optimizer, statistics, identifiability, profiles
void add_to_result(Json& result, const IdentificationResult& fit);

Trajectory history_of(const IdentificationResult& fit);      // history.csv
std::string residuals_csv(const IdentificationResult& fit);  // a row per sample
std::string profile_csv(const IdentificationResult& fit);    // a row per point of a profile

}  // namespace mbsopt::inline app
