#include "app/terminal/interrupt.hpp"

#include <signal.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>

namespace mbsopt::inline app {
namespace {

using Clock = std::chrono::steady_clock;  // clock_gettime, which a signal handler may call
constexpr std::chrono::seconds kOneSignal{1};

struct Caught {
  int signal;
  std::atomic<Clock::rep> first = 0;  // when it came, 0: not yet
  struct sigaction before = {};
};
std::array<Caught, 3> caught{Caught{SIGINT}, Caught{SIGTERM}, Caught{SIGHUP}};
static_assert(std::atomic<Clock::rep>::is_always_lock_free);

std::atomic<bool> flag = false, guarded = false, listening = false;
struct sigaction pipe_before = {}, file_size_before = {};

extern "C" void on_signal(int signal) {
  const int error = errno;
  flag = true;
  const Clock::rep now = Clock::now().time_since_epoch().count();
  for (Caught& c : caught) {
    if (c.signal != signal) continue;
    Clock::rep first = 0;
    if (!c.first.compare_exchange_strong(first, now) && Clock::duration(now - first) > kOneSignal) {
      ::signal(signal, SIG_DFL);
      ::raise(signal);
    }
  }
  errno = error;
}

extern "C" void on_broken_pipe(int) {
  flag = true;
  ::signal(SIGPIPE, SIG_IGN);  // later output fails in the same way
}

void install(int signal, void (*handler)(int), struct sigaction& before) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(signal, &action, &before);
}

void listen() {
  for (Caught& c : caught) {
    c.first = 0;
    install(c.signal, on_signal, c.before);
    if (c.signal == SIGHUP && c.before.sa_handler == SIG_IGN) ::sigaction(c.signal, &c.before, nullptr);
  }
  listening = true;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  flag = false;
  listening = false;
  guarded = true;
  install(SIGPIPE, on_broken_pipe, pipe_before);
  install(SIGXFSZ, SIG_IGN, file_size_before);
}

InterruptGuard::~InterruptGuard() {
  if (listening)
    for (const Caught& c : caught) ::sigaction(c.signal, &c.before, nullptr);
  ::sigaction(SIGPIPE, &pipe_before, nullptr);
  ::sigaction(SIGXFSZ, &file_size_before, nullptr);
  guarded = false;
  listening = false;
}

bool interrupted() {
  if (guarded && !listening) listen();
  return flag;
}

void interrupt() { flag = true; }

}  // namespace mbsopt::inline app
