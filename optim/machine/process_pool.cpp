#include "optim/machine/process_pool.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <iterator>
#include <optional>
#include <stdexcept>

#include "optim/machine/write_all.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr int kPollMilliseconds = 50, kPollRemoteMilliseconds = 5;
// Container runtimes kill 10 s after their request to end. This leaves half of it to write the results.
constexpr std::chrono::seconds kGrace{5};
using Worker = ProcessPool::Worker;
// The first byte of a reply, and its last one. A truncated reply lacks the last byte.
constexpr char kReturned = 'R', kThrew = 'E', kEnd = '.';

[[noreturn]] void be_worker(int pipe_end, pid_t parent, const std::function<std::string(int)>& work, int job) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a worker does not outlive the run it belongs to
  if (::getppid() != parent) ::_exit(1);
  ::signal(SIGPIPE, SIG_IGN);
  // Locks and files of the run end with the run, not with its last worker.
  if (pipe_end > STDERR_FILENO + 1) ::close_range(STDERR_FILENO + 1, static_cast<unsigned>(pipe_end) - 1, 0);
  ::close_range(static_cast<unsigned>(pipe_end) + 1, ~0U, 0);
  std::string reply;
  try {
    reply = kReturned + work(job);
  } catch (const std::exception& error) {
    reply = std::string(1, kThrew) + error.what();
  } catch (...) {
    reply = std::string(1, kThrew) + "an exception that says nothing";
  }
  write_all(pipe_end, reply + kEnd);  // if this fails, nobody listens any more
  ::_exit(0);                         // without the destructors and buffers of the process this is a copy of
}

// Returns nothing if the system has no more pipes or processes; errno says which.
std::optional<Worker> started(int job, const std::function<std::string(int)>& work) {
  std::array<int, 2> ends;
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  const pid_t parent = ::getpid(), process = ::fork();
  if (process < 0) {
    const int why = errno;
    ::close(ends[0]), ::close(ends[1]);
    errno = why;
    return std::nullopt;
  }
  if (process == 0) {
    ::close(ends[0]);
    be_worker(ends[1], parent, work, job);
  }
  ::close(ends[1]);
  return Worker{job, process, ends[0], {}};
}

// Returns true when the reply is complete.
bool receive(Worker& worker) {
  std::array<char, 1 << 14> buffer;
  const ssize_t count = ::read(worker.descriptor, buffer.data(), buffer.size());
  if (count > 0) worker.received.append(buffer.data(), static_cast<std::size_t>(count));
  return count == 0 || (count < 0 && errno != EINTR);
}

JobReply reply_of(Worker& worker) {
  ::close(worker.descriptor);
  int status = 0;
  while (::waitpid(worker.process, &status, 0) < 0 && errno == EINTR) {
  }
  std::string& text = worker.received;
  const bool whole = text.size() >= 2 && text.back() == kEnd;
  if (whole) {
    text.pop_back();
    const bool ok = text.front() == kReturned;
    text.erase(0, 1);
    return {worker.job, ok, std::move(text)};
  }
  if (WIFSIGNALED(status))
    return {worker.job, false,
            fmt::format("its process was ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)))};
  return {worker.job, false, fmt::format("its process ended with code {}", WEXITSTATUS(status))};
}

}  // namespace

ProcessPool::ProcessPool(int workers, std::function<std::string(int)> work)
    : room_(static_cast<std::size_t>(std::max(1, workers))), work_(std::move(work)) {}

ProcessPool::~ProcessPool() {
  tell(SIGKILL);
  for (Worker& worker : workers_) reply_of(worker);
}

bool ProcessPool::start(int job) {
  workers_.reserve(workers_.size() + 1);  // a worker that runs is always known here
  std::optional<Worker> worker = started(job, work_);
  if (worker) {
    workers_.push_back(std::move(*worker));
    return true;
  }
  if (workers_.empty())
    throw std::runtime_error(
        fmt::format("the system gives no worker process: {} ('ulimit -a' lists its limits)", std::strerror(errno)));
  room_ = workers_.size();
  return false;
}

std::vector<JobReply> ProcessPool::ended(int milliseconds) {
  if (kill_at_ && Clock::now() >= *kill_at_) tell(SIGKILL);
  std::vector<pollfd> waiting;
  for (const Worker& worker : workers_) waiting.push_back({worker.descriptor, POLLIN, 0});
  ::poll(waiting.data(), waiting.size(), milliseconds);
  std::vector<JobReply> replies;
  for (std::size_t i = waiting.size(); i-- > 0;) {
    if (waiting[i].revents == 0 || !receive(workers_[i])) continue;
    Worker worker = std::move(workers_[i]);
    workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(i));
    replies.push_back(reply_of(worker));
  }
  return replies;
}

void ProcessPool::stop() {
  tell(SIGTERM);
  kill_at_ = Clock::now() + kGrace;
}

void ProcessPool::tell(int signal) const {
  for (const Worker& worker : workers_) ::kill(worker.process, signal);
}

void run_in_processes(const std::vector<int>& jobs, int workers, const std::function<std::string(int)>& work,
                      const std::function<void(const JobReply&)>& done, const std::function<bool()>& go_on,
                      RemoteWorkers* others) {
  ProcessPool pool(workers, work);
  auto next = jobs.begin();
  bool stopping = false;
  const auto start = [&](int job) { return (others && others->start(job)) || (pool.has_room() && pool.start(job)); };
  const auto fill = [&] {
    while (!stopping && next != jobs.end() && start(*next)) ++next;
  };
  fill();
  while (!pool.idle() || (others && !others->idle()) || (next != jobs.end() && !stopping)) {
    std::vector<JobReply> replies = pool.ended(others ? kPollRemoteMilliseconds : kPollMilliseconds);
    if (others) std::ranges::move(others->ended(), std::back_inserter(replies));
    fill();  // before done(), which may wait for a disk
    for (const JobReply& reply : replies) done(reply);
    if (!stopping && go_on && !go_on()) {
      stopping = true;
      pool.stop();
      if (others) others->stop();
    }
  }
}

}  // namespace mbsopt::inline optim
