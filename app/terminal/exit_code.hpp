// The exit codes of the program (docs/cli.md).
#pragma once

namespace mbsopt::inline app {

enum ExitCode : int {
  kDone = 0,
  kNumericalFailure = 1,  // or what was computed could not be written
  kBadInput = 2,
  kCheckFailed = 3,
  kInterrupted = 130,  // 128 + SIGINT, as shells do
};

}  // namespace mbsopt::inline app
