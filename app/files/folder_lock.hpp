// An output folder belongs to the one command that writes into it. A lock (flock) on the folder itself marks it; the
// system releases the lock whenever the process ends. It leaves no file. Some network file systems have no such lock;
// there the journal's checksums reveal two commands at the latest.
#pragma once

#include <filesystem>

namespace mbsopt::inline app {

class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);  // throws OutputError while another one holds it
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  bool held() const { return held_; }  // false: this file system has none

 private:
  int descriptor_ = -1;
  bool held_ = false;
};

}  // namespace mbsopt::inline app
