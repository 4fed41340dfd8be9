// Signals to a command that runs in this process: before its handler is there they would end the tests.
#pragma once

#include <signal.h>

#include <chrono>
#include <thread>

namespace mbsopt {

inline void wait_for_handler(int signal) {
  struct sigaction now = {};
  do {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::sigaction(signal, nullptr, &now);
  } while (now.sa_handler == SIG_DFL);
}

}  // namespace mbsopt
