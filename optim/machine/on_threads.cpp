#include "optim/machine/on_threads.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace mbsopt::inline optim {

void on_threads(std::size_t jobs, int threads, const std::function<void(std::size_t job)>& work) {
  std::vector<std::exception_ptr> thrown(jobs);
  std::atomic<std::size_t> next = 0;
  const auto run = [&] {
    for (std::size_t job = next++; job < jobs; job = next++) {
      try {
        work(job);
      } catch (...) {
        thrown[job] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t wanted = std::min(jobs, static_cast<std::size_t>(std::max(1, threads)));
    try {
      while (others.size() + 1 < wanted) others.emplace_back(run);
    } catch (const std::system_error&) {  // the system has no further thread: those that run do all jobs
    }
    run();
  }
  for (const std::exception_ptr& exception : thrown)
    if (exception) std::rethrow_exception(exception);
}

}  // namespace mbsopt::inline optim
