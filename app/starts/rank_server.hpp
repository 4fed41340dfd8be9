// The ranks of mpirun other than 0 compute starts for rank 0 (start_workers.hpp).
#pragma once

#include "app/starts/ranks.hpp"
#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

// Serves until rank 0 dismisses all. terms are those of the program. Returns the exit code.
int serve(Ranks& ranks, const NamedTerms& terms = {});
void dismiss(Ranks& ranks);

}  // namespace mbsopt::inline app
