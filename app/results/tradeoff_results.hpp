// The table of `tradeoff` by the names of its columns, which docs/tradeoffs.md explains. tradeoff.csv holds all
// columns; result.json, the terminal and the report take those that they show.
//
//   columns_of(row, quantities).at("rhs_evaluations")   // 204
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "app/files/json_text.hpp"
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

// Adds the columns of a row that have a value.
void add_columns(Json& json, const Tradeoff& tradeoff, const TradeoffRow& row,
                 std::initializer_list<const char*> names);

}  // namespace mbsopt::inline app
