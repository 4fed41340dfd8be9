// Signals end processes: each case runs in one of its own.
#include "app/terminal/interrupt.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <thread>

using namespace mbsopt;

namespace {

constexpr int kEndedBySignal = 1000;

// Runs this in a process. Returns its exit code, or kEndedBySignal + the signal.
int outcome_of(const std::function<int()>& work) {
  const pid_t process = ::fork();
  if (process == 0) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(signal, SIG_DFL);
    ::alarm(60);
    ::_exit(work());
  }
  int status = 0;
  ::waitpid(process, &status, 0);
  return WIFSIGNALED(status) ? kEndedBySignal + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

TEST_CASE("a signal ends who never looks at it, and is told to who does", "[interrupt]") {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    CHECK(outcome_of([&] {
            const InterruptGuard guard;
            ::raise(signal);
            return 0;
          }) == kEndedBySignal + signal);
    CHECK(outcome_of([&] {
            const InterruptGuard guard;
            const bool before = interrupted();
            ::raise(signal);
            return before ? 1 : interrupted() ? 2 : 3;
          }) == 2);
    CHECK(outcome_of([&] {
            {
              const InterruptGuard guard;
              interrupted();
            }
            ::raise(signal);
            return 0;
          }) == kEndedBySignal + signal);
  }
}

TEST_CASE("signals within a second are one, as GNU timeout sends them; a later one ends at once", "[interrupt]") {
  const auto after = [](std::chrono::milliseconds pause) {
    return outcome_of([&] {
      const InterruptGuard guard;
      interrupted();
      ::raise(SIGTERM);
      std::this_thread::sleep_for(pause);
      ::raise(SIGTERM);
      return interrupted() ? 2 : 3;
    });
  };
  CHECK(after(std::chrono::milliseconds(0)) == 2);
  CHECK(after(std::chrono::milliseconds(1200)) == kEndedBySignal + SIGTERM);
}

TEST_CASE("a broken pipe is told, as often as it comes; what nohup ignores stays ignored", "[interrupt]") {
  CHECK(outcome_of([] {
          const InterruptGuard guard;
          ::raise(SIGPIPE);
          std::this_thread::sleep_for(std::chrono::milliseconds(1200));
          ::raise(SIGPIPE);
          return interrupted() ? 2 : 3;
        }) == 2);
  CHECK(outcome_of([] {
          ::signal(SIGHUP, SIG_IGN);
          const InterruptGuard guard;
          interrupted();
          ::raise(SIGHUP);
          return interrupted() ? 2 : 3;
        }) == 3);
}
