// Jobs in processes of their own, so many at a time: for solvers that may not run twice in one process (Ipopt with
// MUMPS). Each job is a copy (fork) of this process as it is; what it returns is sent back as text. One that crashes
// takes nothing else along. The order in which jobs end depends on the machine; what they return does not.
//
//   run_in_processes(20, 4, [&](int job) { return text_of(solve(starts[job])); },
//                    [&](const JobReply& reply) { replies[reply.job] = reply; });
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace mbsopt {

struct JobReply {
  int job = 0;
  bool ok = false;
  std::string text;  // what the job returned; else in words why it did not
};

// work runs in the other process, done here, in any order. go_on is asked about every 50 ms: when it says no, the jobs
// under way get SIGTERM and may still reply, and no other job begins. Throws std::runtime_error where the system gives
// no process.
void run_in_processes(const std::vector<int>& jobs, int workers, const std::function<std::string(int job)>& work,
                      const std::function<void(const JobReply&)>& done, const std::function<bool()>& go_on = {});

}  // namespace mbsopt
