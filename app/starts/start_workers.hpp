// Who computes the starts of a multistart: worker processes of this machine (process_pool.hpp); under mpirun also those
// of the other ranks, which begin a start as soon as they have ended one.
//
// A rank is told once what the starts are of, reads the problem itself, and then gets their numbers. What computes a
// start is the same function everywhere, in a process of its own everywhere: results do not depend on who computed
// them.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "app/run/run.hpp"
#include "app/starts/ranks.hpp"
#include "optim/machine/process_pool.hpp"

namespace mbsopt {

struct StartWork {
  Json task;  // all that `record` is made from, beside the problem
  std::function<Json(int start)> record;
};

// Like run_in_processes(); what replies is the text of the record. waiting: called about every 50 ms, to show progress.
// Throws std::runtime_error where a rank cannot work.
void compute_starts(Run& run, const std::vector<int>& starts, const StartWork& work,
                    const std::function<void(const JobReply&)>& done, const std::function<void()>& waiting);

}  // namespace mbsopt
