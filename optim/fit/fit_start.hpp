// The start of a fit: how far it is from the data, and warnings of the derivatives there. Laws jump at instants which
// the unknowns move, or differences of residuals disagree with their derivatives (difference_comparison.hpp).
//
//   const FitStart start = start_of_fit(problem, data);      // problem: cut into windows
#pragma once

#include <string>
#include <vector>

#include "optim/fit/identification.hpp"

namespace mbsopt::inline optim {

struct FitStart {
  // The residuals and the scores of the fitted experiments, but for those that could not be simulated.
  IdentificationResult residuals;
  std::vector<std::string> warnings;  // sentences; none if the start cannot be simulated, which the fit itself says
};

// data: one table per experiment. simulation_progress is called from any thread; false abandons the comparison.
FitStart start_of_fit(const Problem& problem, const std::vector<CsvTable>& data,
                      const IdentificationOptions& options = {});

}  // namespace mbsopt::inline optim
