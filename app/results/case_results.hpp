// The objectives of a problem's load cases: into result.json, "cases", and as a table on standard output.
#pragma once

#include "app/run/run.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline app {

// Takes the values of the file; does nothing without cases. If a case fails, so does the run.
void add_cases(Run& run, bool gradients, GradientMethod method = GradientMethod::automatic);

// Runs `check` for each case. Returns false if gradients disagree.
bool check_cases(Run& run);

// The number of threads for load cases.
int case_threads(const Run& run);

}  // namespace mbsopt::inline app
