// Files that are whole or absent: written beside their final name, flushed to the disk, then renamed into place.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace mbsopt {

// A file or folder that must not or cannot be used, with the reason.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The system did not take what was to be written.
class WriteError : public OutputError {
 public:
  WriteError(const std::filesystem::path& path, const char* what);  // with the reason that errno gives
};

void write_file_atomically(const std::filesystem::path& path, std::string_view content);  // throws WriteError

// With the folders around it. Throws OutputError where that is not possible, or where a file has the name.
void create_folder(const std::filesystem::path& path);

// For commands that write what a user will edit: throws OutputError where there is anything at `path`.
void refuse_to_overwrite(const std::filesystem::path& path, std::string_view command);

// Whether a file's name is that of the part of such a file that was never renamed, since its writer was killed.
bool is_part_of(std::string_view part, std::string_view file);

}  // namespace mbsopt
