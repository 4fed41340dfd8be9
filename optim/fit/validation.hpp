// Experiments that validate: the shared parameters stay as fitted, the free ones are refitted, the residuals are
// scored.
#pragma once

#include <cstddef>

#include "optim/fit/fit_context.hpp"

namespace mbsopt::inline optim {

void validate(FitContext& fit, std::size_t experiment);

}  // namespace mbsopt::inline optim
