// Solves a design by the optimiser that its problem chooses.
#pragma once

#include <functional>

#include "optim/design/design_program.hpp"

namespace mbsopt::inline optim {

// Called after every iteration; false stops the search.
using SearchProgress = std::function<bool(const NlpProgress&)>;

// From the start of the program. Adds the seed, and simulations beside those of the program's evaluator, to the result.
NlpResult solve(DesignProgram& program, const SearchProgress& progress, DesignResult& result);

}  // namespace mbsopt::inline optim
