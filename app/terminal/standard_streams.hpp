#pragma once

#include <fcntl.h>
#include <unistd.h>

namespace mbsopt::inline app {

// Opens /dev/null in place of closed standard streams. Otherwise the first opened file, such as a journal, would be
// taken for one of them and receive messages.
inline void open_missing_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", O_RDWR);  // takes the lowest free number: this one
}

}  // namespace mbsopt::inline app
