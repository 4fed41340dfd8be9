// The table of `tradeoff` by the names of its columns, which docs/tradeoffs.md explains. tradeoff.csv holds all
// columns; result.json, the terminal and the report take those that they show.
//
//   columns_of(row, quantities).at("rhs_evaluations")   // 204
#pragma once

#include <string>
#include <vector>

#include "app/files/json_text.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {

// Columns in the order of tradeoff.csv: words, counts, figures in SI units. null or "": the row has no such value.
Json columns_of(const TradeoffRow& row, const std::vector<Quantity>& quantities);

// tradeoff.csv: a row per setting, measured or skipped.
std::string to_csv(const Tradeoff& tradeoff);

// Errors per quantity, by name; unknown ones are left out.
Json errors_json(const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors);
std::string duration_text(double seconds);  // "12.3 ms", "1.5 s"
// "1.2e-04", "-" of an error that is not there; "< 4.3e-06" below what the reference is certain of.
std::string error_text(double error, double certificate = 0);

}  // namespace mbsopt::inline app
