// How far the start of a fit is from the data, without derivatives: one simulation per fitted experiment.
#pragma once

#include <vector>

#include "optim/fit/identification.hpp"

namespace mbsopt {

// The residuals and the scores of the fitted experiments at their start values; of one that could not be simulated
// none, and why in message. problem: cut into windows.
IdentificationResult residuals_at_start(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options = {});

}  // namespace mbsopt
