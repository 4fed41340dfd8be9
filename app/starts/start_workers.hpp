// The workers of a multistart: worker processes of this machine (process_pool.hpp), and under mpirun also those of the
// other ranks. These begin a start as soon as they have ended one.
//
// A rank gets the task once, reads the problem itself, and then gets the numbers of starts. The same function computes
// a start everywhere, always in a process of its own. So results do not depend on the worker.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "app/run/run.hpp"
#include "app/starts/ranks.hpp"
#include "optim/machine/process_pool.hpp"

namespace mbsopt::inline app {

struct StartWork {
  Json task;  // all that `record` is made from, beside the problem
  std::function<Json(int start)> record;
};

// Works like run_in_processes(); the reply is the text of the record. It calls waiting about every 50 ms, to show
// progress. Throws std::runtime_error if a rank cannot work.
void compute_starts(Run& run, const std::vector<int>& starts, const StartWork& work,
                    const std::function<void(const JobReply&)>& done, const std::function<void()>& waiting);

}  // namespace mbsopt::inline app
