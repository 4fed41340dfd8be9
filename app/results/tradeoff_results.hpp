// The results of `tradeoff`: its table by the names of its columns, which docs/tradeoffs.md explains, and what
// result.json and standard output show of it. tradeoff.csv holds all columns, the others take those that they show.
//
//   columns_of(row, quantities).at("rhs_evaluations")   // 204
#pragma once

#include <string>
#include <vector>

#include "app/run/run.hpp"
#include "optim/tradeoff/advice.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {

// Columns in the order of tradeoff.csv: words, counts, figures in SI units. null or "": the row has no such value.
Json columns_of(const TradeoffRow& row, const std::vector<Quantity>& quantities);
Json columns_of(const PenaltyStudyRow& row, const PenaltyStudy& study);

// tradeoff.csv: a row per setting, measured or skipped; of a penalty study, a row per alpha.
std::string to_csv(const Tradeoff& tradeoff);
std::string to_csv(const PenaltyStudy& study);

// A row of a penalty study holds errors of accelerations, and two runs.
struct AccelerationError {
  const char *column, *words, *legend;  // legend: in plots
  double PenaltyStudyRow::*value;
};
inline constexpr AccelerationError kAccelerationErrors[] = {
    {"model_error", "model error", "penalty against the constrained equations", &PenaltyStudyRow::model_error},
    {"rounding", "rounding by Cholesky", "rounding by Cholesky", &PenaltyStudyRow::rounding_error},
    {"augmented_lagrangian", "augmented Lagrangian", "augmented Lagrangian", &PenaltyStudyRow::augmented_error}};
struct PenaltyRun {
  const char *column, *words;
  std::size_t PenaltyStudyRow::*row;  // of the table
};
inline constexpr PenaltyRun kPenaltyRuns[] = {{"quasidefinite", "quasi-definite", &PenaltyStudyRow::quasidefinite},
                                              {"cholesky", "cholesky", &PenaltyStudyRow::cholesky}};

// Errors per quantity, by name; unknown ones are left out.
Json errors_json(const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors);
std::string duration_text(double seconds);  // "12.3 ms", "1.5 s"
// "1.2e-04", "-" of an error that is not there; "< 4.3e-06" below what the reference is certain of.
std::string error_text(double error, double certificate = 0);

// Adds the methods, their difference and the right values, with a warning if these are uncertain.
void add_reference(Run& run, const TradeoffReference& reference);
// Adds the scene's own settings and the defaults.
void add_given_settings(Run& run, const Tradeoff& tradeoff);
// Adds the errors in the sum of squares of identify, of the scene's own settings and of the defaults.
void add_fit_errors(Run& run, const FitErrors& fit);
// Adds advice per quantity, and for the task of the file, a design or an identification, if it has one.
void add_recommendations(Run& run, const Tradeoff& tradeoff, TaskAdviser* adviser);
void add_outcomes(Run& run, const Tradeoff& tradeoff);  // how many were measured; what was not, and why
// Adds the choice of --apply. The run fails if there is nothing to choose.
void add_applied(Run& run, const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit);

void add_penalty_study(Run& run, const PenaltyStudy& study);

}  // namespace mbsopt::inline app
