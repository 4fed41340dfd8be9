// Cuts experiments into their windows. A window is an experiment of its own, with the samples between its ends:
//
//   run1, free theta0, omega0     ->     run1.1, run1.2, ..., each with its own theta0, omega0
//
// Long motions that amplify small errors are then fitted by many short ones, whose residuals depend on all parameters
// smoothly. A window starts with values whose motion meets local cubic polynomials of its channels, in value and slope,
// at their first samples. The initial assembly makes them consistent with joints.
//
//   const CutProblem cut = cut_into_windows(problem, data);
//   run_identification(cut.problem, cut.data);        // as run_identification(problem, data)
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

struct CutProblem {
  Problem problem;
  std::vector<CsvTable> data;         // one per experiment
  std::vector<std::string> warnings;  // of lengths beyond the record, and of starts that could not be guessed
};

// A problem without windows remains as it is. go_on: within a simulation; false leaves the other starts as they are
// given. Throws std::invalid_argument and CsvError with the place.
CutProblem cut_into_windows(const Problem& problem, const std::vector<CsvTable>& data,
                            const std::function<bool(double t)>& go_on = {});

}  // namespace mbsopt::inline optim
