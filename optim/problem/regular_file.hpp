// The content of a regular file. Pipes and devices are refused, because they may never end. A second reader of a pipe
// also finds nothing, but problem files, data and journals are read more than once (to simulate, and for their
// checksums).
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>

namespace mbsopt::inline optim {

// The reason why a file cannot be read, without its name.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws FileError, also if the file is larger than at_most [bytes].
std::string content_of_regular_file(const std::filesystem::path& file,
                                    std::size_t at_most = std::numeric_limits<std::size_t>::max());

}  // namespace mbsopt::inline optim
