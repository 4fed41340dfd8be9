// Jobs in processes of their own, so many at a time: for solvers that may not run twice in one process (Ipopt with
// MUMPS). Each job is a copy (fork) of this process as it is; what it returns is sent back as text. One that crashes
// takes nothing else along. The order in which jobs end depends on the machine; what they return does not.
//
//   run_in_processes(20, 4, [&](int job) { return text_of(solve(starts[job])); },
//                    [&](const JobReply& reply) { replies[reply.job] = reply; });
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace mbsopt {

struct JobReply {
  int job = 0;
  bool ok = false;
  std::string text;  // what the job returned; else in words why it did not
};

// The processes that are at work.
class ProcessPool {
 public:
  // work runs in the other process. One that has been started has seen this one as it was then.
  ProcessPool(int workers, std::function<std::string(int job)> work);
  ~ProcessPool();  // kills those that are still at work
  ProcessPool(const ProcessPool&) = delete;
  ProcessPool& operator=(const ProcessPool&) = delete;

  bool has_room() const { return workers_.size() < room_; }
  bool idle() const { return workers_.empty(); }
  void start(int job);  // throws std::runtime_error where the system gives no process
  // The replies of jobs that have ended; waits at most so long for the first, also where none is under way.
  std::vector<JobReply> ended(int milliseconds);
  void stop();  // SIGTERM to all that are at work; they may still reply

  struct Worker {
    int job;
    pid_t process;
    int descriptor;
    std::string received;
  };

 private:
  std::size_t room_;
  std::function<std::string(int)> work_;
  std::vector<Worker> workers_;
};

// All jobs, so many at a time; done runs here, in any order. go_on is asked about every 50 ms: when it says no, the
// jobs under way get SIGTERM and may still reply, and no other job begins. Throws std::runtime_error where the system
// gives no process.
void run_in_processes(const std::vector<int>& jobs, int workers, const std::function<std::string(int job)>& work,
                      const std::function<void(const JobReply&)>& done, const std::function<bool()>& go_on = {});

}  // namespace mbsopt
