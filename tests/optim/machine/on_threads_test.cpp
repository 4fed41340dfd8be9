#include "optim/machine/on_threads.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <vector>

using namespace mbsopt;

TEST_CASE("all jobs are done where the system has no further thread", "[on_threads]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // it needs terabytes of addresses
#endif
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {  // a stack of a thread has 8 MB: more than is left to it
    std::vector<int> done(20);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t most = pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + (rlim_t{1} << 20);
    const rlimit limit{most, most};
    if (::setrlimit(RLIMIT_AS, &limit) != 0) ::_exit(2);
    on_threads(done.size(), 4, [&](std::size_t job) { done[job] = 1; });
    ::_exit(std::all_of(done.begin(), done.end(), [](int d) { return d == 1; }) ? 0 : 1);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}
