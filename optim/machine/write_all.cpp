#include "optim/machine/write_all.hpp"

#include <unistd.h>

#include <cerrno>

namespace mbsopt::inline optim {

bool write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace mbsopt::inline optim
