// The points of a sweep, computed block by block. A block corresponds to a start of a multistart. It runs in a worker
// process or on another rank, and its record is a line of the journal (start_workers.hpp):
//
//   {"start": 3, "status": "ok", "rows": [{"psi": [0.2, 1.1], "true": [null, 1.2], "psi_rho": [[...], [...]]},
//                                         {"failed": "why"}]}
//
// psi_rho is there if --gradients requests it.
#pragma once

#include <vector>

#include "app/run/sweep_points.hpp"
#include "app/starts/start_workers.hpp"

namespace mbsopt::inline app {

// Returns a row per point, in their order, or null if it was not computed. The journal gives those of earlier runs.
std::vector<Json> swept(LongRun& long_run, const SweepPoints& points, long seed);

// The blocks, from the task of this process or another one.
StartWork sweep_work(const Problem& problem, const Json& task);

}  // namespace mbsopt::inline app
