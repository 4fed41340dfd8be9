// Files that are whole or absent: they are written beside their final name, flushed to the disk, and then renamed.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace mbsopt::inline app {

// A file or folder that must not or cannot be used, with the reason.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The system did not accept the output.
class WriteError : public OutputError {
 public:
  WriteError(const std::filesystem::path& path, const char* what);  // adds the reason from errno
};

void write_file_atomically(const std::filesystem::path& path, std::string_view content);  // throws WriteError

// Creates the folder and its parents. Throws OutputError if that is not possible, or if a file has the name.
void create_folder(const std::filesystem::path& path);

// Serves commands that write files for a user to edit. Throws OutputError if anything exists at `path`.
void refuse_to_overwrite(const std::filesystem::path& path, std::string_view command);

// Returns whether `part` is the name of a temporary part of the file that was never renamed, because its writer was
// killed.
bool is_part_of(std::string_view part, std::string_view file);

}  // namespace mbsopt::inline app
