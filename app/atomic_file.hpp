// Files that are whole or absent: written beside their final name, flushed to the disk, then renamed into place.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace mbsopt {

// A file or folder that cannot be written, with the reason the system gives.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

void write_file_atomically(const std::filesystem::path& path, std::string_view content);  // throws OutputError

}  // namespace mbsopt
