#include "app/files/folder_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "app/files/atomic_file.hpp"

namespace mbsopt::inline app {

FolderLock::FolderLock(const std::filesystem::path& folder)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) throw WriteError(folder, "cannot be opened");
  // Workers die with their run, but a newly forked worker holds its lock until then.
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    held_ = ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0;
    if (held_ || errno != EWOULDBLOCK) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ::close(descriptor_);
  throw OutputError(
      fmt::format("{}: another mbsopt is writing into this folder; wait for its end, or name another folder with --out",
                  folder.string()));
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace mbsopt::inline app
