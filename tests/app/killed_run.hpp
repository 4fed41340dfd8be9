// A command that is killed on its way.
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "app/command/command_line.hpp"
#include "app/files/journal.hpp"
#include "tests/app/swinging_rod.hpp"

namespace mbsopt {

// A run in a process of its own that gets the signal as soon as its journal has so many lines of a kind.
inline void kill_at(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                    const std::string& key, long count, int signal = SIGKILL) {
  const pid_t process = ::fork();
  if (process == 0) {
    std::ostringstream out, err;
    run_command_line(arguments, out, err);
    ::_exit(0);
  }
  for (int i = 0; i < 6000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (std::filesystem::exists(folder / kJournalFile) && journal_lines(folder, key) >= count) break;
  }
  ::kill(process, signal);
  int status = 0;
  ::waitpid(process, &status, 0);
}

}  // namespace mbsopt
