// Ctrl-C, SIGTERM and SIGHUP: a flag that running commands look at after each step, so that the best so far is kept.
// Signals of one kind within a second are one (GNU timeout sends its signal to the process and again to its group);
// another one later ends the program at once. A signal handler can reach nothing but static flags; these are the only
// ones.
#pragma once

namespace mbsopt {

// While it lives, the first look at the flag installs its handlers; until then, and afterwards, these signals end the
// program: who never looks must not keep it alive. SIGHUP stays ignored where it is (nohup). SIGPIPE sets the flag,
// too, from the beginning: writing then fails, which is said at the end. SIGXFSZ is ignored: writing fails, too.
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
