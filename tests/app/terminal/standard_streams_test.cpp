#include "app/terminal/standard_streams.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>

using namespace mbsopt;

TEST_CASE("no file is taken for a standard stream that was closed", "[command]") {
  for (int closed = 0; closed < 8; ++closed) {
    INFO("closed: " << closed);
    const pid_t process = ::fork();
    if (process == 0) {
      for (int stream = 0; stream < 3; ++stream)
        if (closed & (1 << stream)) ::close(stream);
      open_missing_standard_streams();
      const int file = ::open("/dev/null", O_RDONLY);
      ::_exit(file > 2 && ::write(STDOUT_FILENO, "", 0) == 0 ? 0 : 1);
    }
    int status = 0;
    ::waitpid(process, &status, 0);
    CHECK(status == 0);
  }
}
