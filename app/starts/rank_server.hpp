// The ranks of mpirun other than 0 compute starts for rank 0 (start_workers.hpp).
#pragma once

#include "app/starts/ranks.hpp"

namespace mbsopt {

// Until rank 0 dismisses all. Returns the exit code.
int serve(Ranks& ranks);
void dismiss(Ranks& ranks);

}  // namespace mbsopt
