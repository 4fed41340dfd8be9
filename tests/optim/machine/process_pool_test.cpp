#include "optim/machine/process_pool.hpp"

#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <map>
#include <new>
#include <numeric>
#include <stdexcept>
#include <thread>

using namespace mbsopt;
using Catch::Contains;

namespace {

// A count that all processes share.
class SharedCount {
 public:
  SharedCount()
      : count_(new (::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1,
                           0)) std::atomic<int>(0)) {}
  ~SharedCount() { ::munmap(count_, sizeof(std::atomic<int>)); }
  SharedCount(const SharedCount&) = delete;
  SharedCount& operator=(const SharedCount&) = delete;
  std::atomic<int>& operator*() const { return *count_; }

 private:
  std::atomic<int>* count_;
};

// False where it never comes: after a minute.
template <class Condition>
bool wait_until(const Condition& condition) {
  for (int i = 0; i < 6000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return condition();
}

std::map<int, JobReply> replies_of(int count, int workers, const std::function<std::string(int)>& work) {
  std::vector<int> jobs(static_cast<std::size_t>(count));
  std::iota(jobs.begin(), jobs.end(), 0);
  std::map<int, JobReply> replies;
  run_in_processes(jobs, workers, work, [&](const JobReply& reply) { replies[reply.job] = reply; });
  return replies;
}

}  // namespace

TEST_CASE("every job replies, however many workers there are", "[process_pool]") {
  const int workers = GENERATE(1, 2, 5, 50);
  const auto replies = replies_of(20, workers, [](int job) { return std::to_string(job * job); });
  REQUIRE(replies.size() == 20);
  for (const auto& [job, reply] : replies) {
    CHECK(reply.ok);
    CHECK(reply.text == std::to_string(job * job));
  }
}

TEST_CASE("jobs run in processes of their own, and leave nothing in this one", "[process_pool]") {
  static int changed = 0;
  const auto replies =
      replies_of(3, 2, [](int) { return std::to_string(++changed) + " " + std::to_string(::getpid()); });
  CHECK(changed == 0);
  CHECK(replies.at(0).text.substr(0, 2) == "1 ");
  CHECK(replies.at(1).text.substr(0, 2) == "1 ");
  CHECK(replies.at(0).text != replies.at(1).text);
}

TEST_CASE("a long reply arrives whole", "[process_pool]") {
  const std::string text(3'000'000, 'x');
  CHECK(replies_of(2, 2, [&](int job) { return text + std::to_string(job); }).at(1).text == text + "1");
}

TEST_CASE("a job that throws, crashes or leaves is one reply in words; the others are not disturbed",
          "[process_pool]") {
  const auto replies = replies_of(4, 2, [](int job) -> std::string {
    if (job == 0) throw std::runtime_error("the crank locks");
    if (job == 1) ::raise(SIGKILL);
    if (job == 2) ::_exit(7);
    return "fine";
  });
  CHECK((!replies.at(0).ok && replies.at(0).text == "the crank locks"));
  CHECK_FALSE(replies.at(1).ok);
  CHECK_THAT(replies.at(1).text, Contains("signal 9"));
  CHECK_FALSE(replies.at(2).ok);
  CHECK_THAT(replies.at(2).text, Contains("code 7"));
  CHECK((replies.at(3).ok && replies.at(3).text == "fine"));
}

TEST_CASE("workers work at the same time", "[process_pool]") {
  SharedCount begun;
  const auto replies = replies_of(4, 4, [&](int) {
    ++*begun;
    return std::string(wait_until([&] { return *begun == 4; }) ? "together" : "alone");
  });
  for (const auto& [job, reply] : replies) CHECK(reply.text == "together");
}

TEST_CASE("when it is to stop, no job begins and those under way are told", "[process_pool]") {
  std::vector<JobReply> replies;
  SharedCount listening;
  static volatile std::sig_atomic_t told = 0;
  run_in_processes(
      {0, 1, 2, 3}, 2,
      [&](int) {
        ::signal(SIGTERM, [](int) { told = 1; });
        ++*listening;
        return std::string(wait_until([] { return told != 0; }) ? "stopped early" : "ran on");
      },
      [&](const JobReply& reply) { replies.push_back(reply); }, [&] { return *listening < 2; });
  REQUIRE(replies.size() == 2);
  for (const JobReply& reply : replies) CHECK(reply.text == "stopped early");
}

TEST_CASE("a worker that ignores SIGTERM is killed after a while", "[process_pool]") {
  std::vector<JobReply> replies;
  SharedCount deaf;
  run_in_processes(
      {0}, 1,
      [&](int) {
        ::signal(SIGTERM, SIG_IGN);
        ++*deaf;
        std::this_thread::sleep_for(std::chrono::minutes(2));
        return std::string("slept");
      },
      [&](const JobReply& reply) { replies.push_back(reply); }, [&] { return *deaf == 0; });
  REQUIRE(replies.size() == 1);
  CHECK_THAT(replies[0].text, Contains("signal 9"));
}

TEST_CASE("where the system gives fewer processes than workers, fewer are used; where it gives none, it is said",
          "[process_pool]") {
  const auto with_descriptors = [](rlim_t most, int workers) {
    rlimit before = {};
    ::getrlimit(RLIMIT_NOFILE, &before);
    const rlimit few{most, before.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &few);
    std::exception_ptr thrown;
    std::size_t count = 0;
    try {
      count = replies_of(20, workers, [](int job) {
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
                return std::to_string(job);
              }).size();
    } catch (...) {
      thrown = std::current_exception();
    }
    ::setrlimit(RLIMIT_NOFILE, &before);  // first: sanitizers look at an exception's memory through descriptors
    std::string error;
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const std::runtime_error& e) {
      error = e.what();
    }
    return std::pair(count, error);
  };
  const int next = ::dup(0);  // the lowest that is free
  ::close(next);
  CHECK(with_descriptors(static_cast<rlim_t>(next) + 4, 16) == std::pair(std::size_t{20}, std::string()));
  const auto [count, error] = with_descriptors(static_cast<rlim_t>(next), 16);
  CHECK(count == 0);
  CHECK_THAT(error, Contains("no worker process") && Contains("Too many open files"));
}
