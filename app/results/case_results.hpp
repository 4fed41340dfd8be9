// The objectives of a problem's load cases: into result.json, "cases", and as a table onto standard output.
#pragma once

#include "app/run/run.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt {

// At the values of the file; without cases nothing. Where a case fails, that is how the run ended.
void add_cases(Run& run, bool gradients, GradientMethod method = GradientMethod::automatic);

// `check` of each case. False where gradients disagree.
bool check_cases(Run& run);

// Threads that a command may use for load cases.
int case_threads(const Run& run);

}  // namespace mbsopt
