#include "app/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace mbsopt {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw OutputError(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

// Closes on every way out; the file is removed unless it was renamed.
struct TemporaryFile {
  std::filesystem::path path;
  int descriptor = -1;
  bool renamed = false;
  ~TemporaryFile() {
    if (descriptor >= 0) ::close(descriptor);
    if (!renamed) ::unlink(path.c_str());
  }
};

void write_all(const TemporaryFile& file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file.descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(file.path, "cannot be written");
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  // The process number keeps two runs that write the same file apart.
  TemporaryFile file{path.parent_path() / fmt::format(".{}.{}.part", path.filename().string(), ::getpid())};
  file.descriptor = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file.descriptor < 0) fail(path, "cannot be created");
  write_all(file, content);
  if (::fsync(file.descriptor) != 0 && errno != EINVAL) fail(path, "cannot be flushed to the disk");
  if (std::rename(file.path.c_str(), path.c_str()) != 0) fail(path, "cannot be put into place");
  file.renamed = true;
}

}  // namespace mbsopt
