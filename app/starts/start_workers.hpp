// The parts of a long computation that workers compute, the journal keeps and `resume` does not compute again: the
// starts of a multistart, and the blocks of a sweep. Both are called starts here. Workers are processes of this machine
// (process_pool.hpp), and under mpirun also those of the other ranks. These begin a start as soon as they have ended
// one.
//
// A rank gets the task once, reads the problem itself, and then gets the numbers of starts. The same function computes
// a start everywhere, always in a process of its own. So results do not depend on the worker.
#pragma once

#include <functional>

#include "app/run/long_run.hpp"
#include "app/starts/ranks.hpp"

namespace mbsopt::inline app {

struct StartWork {
  Json task;  // all that `record` is made from, beside the problem
  std::function<Json(int start)> record;
};

// Computes the starts first, ..., last - 1 that the journal does not hold. done gets the record of each that ends, in
// any order:
//
//   {"start": 7, "status": "converged", ...}
//   {"start": 7, "status": "stopped", ...}                          an interrupt cut it off
//   {"start": 7, "status": "failed", "message": "its process ..."}  its worker crashed
//
// The journal keeps neither of the last two: they may succeed next time. It calls waiting about every 50 ms, to show
// progress. Returns whether all starts have ended, none cut off. Throws std::runtime_error if a rank cannot work.
bool compute_starts(LongRun& long_run, int first, int last, const StartWork& work,
                    const std::function<void(const Json& record)>& done, const std::function<void()>& waiting);

}  // namespace mbsopt::inline app
