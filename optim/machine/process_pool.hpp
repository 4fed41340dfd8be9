// Jobs in a limited number of processes: for solvers that may not run twice in one process (Ipopt with MUMPS). Each job
// is a copy (fork) of this process in its current state, and sends its result back as text. A crash affects its job
// only. The order in which jobs end depends on the machine; their results do not.
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

namespace mbsopt::inline optim {

struct JobReply {
  int job = 0;
  bool ok = false;
  std::string text;  // the job's result, or the reason of its failure
};

// The running processes.
class ProcessPool {
 public:
  // work runs in the other process, which copies the state of this one at its start.
  ProcessPool(int workers, std::function<std::string(int job)> work);
  ~ProcessPool();  // kills those that are still at work
  ProcessPool(const ProcessPool&) = delete;
  ProcessPool& operator=(const ProcessPool&) = delete;

  bool has_room() const { return workers_.size() < room_; }
  bool idle() const { return workers_.empty(); }
  // Returns false if the system gives no further process. From then on the pool has room for the running ones only.
  // Throws std::runtime_error if the system gives none at all.
  bool start(int job);
  // Returns the replies of jobs that have ended. Waits at most so long for the first, even if none is running.
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

// Workers elsewhere, which take jobs before the processes of this machine do.
struct RemoteWorkers {
  virtual ~RemoteWorkers() = default;
  virtual bool start(int job) = 0;            // false: none has room
  virtual std::vector<JobReply> ended() = 0;  // does not wait
  virtual bool idle() const = 0;              // none is at work, or none is waited for any more
  virtual void stop() = 0;
};

// Runs all jobs in so many processes; done runs here, in any order. It calls go_on about every 50 ms. If go_on returns
// false, running jobs get SIGTERM and may still reply, and no other job begins. If the system gives fewer processes
// than workers, it uses these. Throws std::runtime_error if the system gives none. others may be null.
void run_in_processes(const std::vector<int>& jobs, int workers, const std::function<std::string(int job)>& work,
                      const std::function<void(const JobReply&)>& done, const std::function<bool()>& go_on = {},
                      RemoteWorkers* others = nullptr);

}  // namespace mbsopt::inline optim
