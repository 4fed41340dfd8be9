// Ctrl-C and SIGTERM: a flag that running commands look at after each step, so that the best so far is kept.
// A second signal ends the program at once. A signal handler can reach nothing but a static flag; this is the only one.
#pragma once

namespace mbsopt {

// While it lives, SIGINT and SIGTERM set the flag; afterwards they end the program again.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

bool interrupted();
void interrupt();  // as if a signal had come

}  // namespace mbsopt
