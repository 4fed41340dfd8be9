#include "app/files/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "optim/machine/write_all.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::string_view kPart = ".part";

// Closes the file on every path, and removes it unless it was renamed.
struct TemporaryFile {
  std::filesystem::path path;
  int descriptor = -1;
  bool renamed = false;
  ~TemporaryFile() {
    if (descriptor < 0) return;
    ::close(descriptor);
    if (!renamed) ::unlink(path.c_str());
  }
};

// The new name must also survive a loss of power. Some file systems flush no folders.
void flush_folder_of(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

WriteError::WriteError(const std::filesystem::path& path, const char* what)
    : OutputError(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno))) {}

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  // The process number separates two runs that write the same file. O_EXCL follows no link.
  TemporaryFile file{path.parent_path() / fmt::format(".{}.{}{}", path.filename().string(), ::getpid(), kPart)};
  file.descriptor = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file.descriptor < 0) throw WriteError(path, "cannot be created");
  if (!write_all(file.descriptor, content)) throw WriteError(path, "cannot be written");
  if (::fsync(file.descriptor) != 0 && errno != EINVAL) throw WriteError(path, "cannot be flushed to the disk");
  if (std::rename(file.path.c_str(), path.c_str()) != 0) throw WriteError(path, "cannot be put into place");
  file.renamed = true;
  flush_folder_of(path);
}

void create_folder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path))
    throw OutputError(fmt::format("{}: the output folder cannot be created: {}", path.string(),
                                  error ? error.message() : "a file has this name"));
}

void refuse_to_overwrite(const std::filesystem::path& path, std::string_view command) {
  std::error_code unreadable;
  if (std::filesystem::symlink_status(path, unreadable).type() == std::filesystem::file_type::not_found) return;
  throw OutputError(fmt::format(
      "{}: exists already, and {} does not overwrite files; move it away, or name another folder with --out",
      path.string(), command));
}

bool is_part_of(std::string_view part, std::string_view file) {
  const std::string begin = fmt::format(".{}.", file);
  if (!part.starts_with(begin) || !part.ends_with(kPart) || part.size() <= begin.size() + kPart.size()) return false;
  const std::string_view process = part.substr(begin.size(), part.size() - begin.size() - kPart.size());
  return std::all_of(process.begin(), process.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace mbsopt::inline app
