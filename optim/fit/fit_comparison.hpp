// These checks doubt the derivatives of a fit at its start: laws jump at instants which the unknowns move, or
// differences of residuals disagree with their derivatives (difference_comparison.hpp).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

struct UserForce;

struct FitComparisonOptions {
  std::vector<std::shared_ptr<const UserForce>> user_forces = {};
  std::function<bool(double t)> progress = {};  // within a simulation, in any thread; false abandons the comparison
  int threads = 1;
};

// Sentences; of the experiments that are fitted. data: one table per experiment. Empty where the start cannot be
// simulated, which the fit itself says.
std::vector<std::string> doubts_about_fit(const Problem& problem, const std::vector<CsvTable>& data,
                                          const FitComparisonOptions& options = {});

}  // namespace mbsopt
