#include "optim/problem/regular_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace mbsopt::inline optim {
namespace {

struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

[[noreturn]] void fail() {
  if (errno == ENOENT) throw FileError("there is no such file");
  throw FileError(fmt::format("cannot be read: {}", std::strerror(errno)));
}

}  // namespace

std::string content_of_regular_file(const std::filesystem::path& file, std::size_t at_most) {
  // O_NONBLOCK opens a FIFO without a writer at once; it is then refused.
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)};
  struct stat what = {};
  if (in.number < 0 || ::fstat(in.number, &what) != 0) fail();
  if (S_ISDIR(what.st_mode)) throw FileError("is a directory, a file is expected");
  if (!S_ISREG(what.st_mode)) throw FileError("is a pipe or a device, a regular file is expected");
  std::string content;
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const ssize_t count = ::read(in.number, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail();
    if (count == 0) return content;
    content.append(buffer.data(), static_cast<std::size_t>(count));
    if (content.size() > at_most) throw FileError(fmt::format("is larger than {} MiB", at_most >> 20));
  }
}

}  // namespace mbsopt::inline optim
