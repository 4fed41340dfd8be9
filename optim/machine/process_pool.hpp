// Jobs in processes of their own, so many at a time: for solvers that may not run twice in one process (Ipopt with
// MUMPS). Each job is a copy (fork) of this process as it is; what it returns is sent back as text. One that crashes
// takes nothing else along. The order in which jobs end depends on the machine; what they return does not.
//
//   run_in_processes(20, 4, [&](int job) { return text_of(solve(starts[job])); },
//                    [&](const JobReply& reply) { replies[reply.job] = reply; });
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
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
  // False where the system gives no further process: from then on the pool has room for those that are at work only.
  // Throws std::runtime_error where it gives none at all.
  bool start(int job);
  // The replies of jobs that have ended; waits at most so long for the first, also where none is under way.
  std::vector<JobReply> ended(int milliseconds);
  void stop();  // SIGTERM to all that are at work; they may still reply. Who has not after 5 s is killed by ended()

  struct Worker {
    int job;
    pid_t process;
    int descriptor;
    std::string received;
  };

 private:
  using Clock = std::chrono::steady_clock;
  void tell(int signal) const;

  std::size_t room_;
  std::function<std::string(int)> work_;
  std::vector<Worker> workers_;
  std::optional<Clock::time_point> kill_at_;
};

// All jobs, so many at a time; done runs here, in any order. go_on is asked about every 50 ms: when it says no, the
// jobs under way get SIGTERM and may still reply, and no other job begins. Where the system gives fewer processes than
// workers, fewer are used; throws std::runtime_error where it gives none.
void run_in_processes(const std::vector<int>& jobs, int workers, const std::function<std::string(int job)>& work,
                      const std::function<void(const JobReply&)>& done, const std::function<bool()>& go_on = {});

}  // namespace mbsopt
