// Ctrl-C, SIGTERM and SIGHUP set a flag that running commands test after each step, so that they keep the best result.
// Signals of one kind within a second are one (GNU timeout sends its signal to the process and again to its group). A
// later one ends the program at once. A signal handler can access only static flags; these are the only ones.
#pragma once

namespace mbsopt::inline app {

// While it lives, the first test of the flag installs its handlers. Before and afterwards these signals end the
// program: a command that never tests must not prevent this. SIGHUP stays ignored if it was (nohup). SIGPIPE sets the
// flag, too, from the beginning: writing then fails, and the end reports it. SIGXFSZ is ignored, so that writing fails,
// too.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

bool interrupted();
void interrupt();  // has the effect of a signal

}  // namespace mbsopt::inline app
