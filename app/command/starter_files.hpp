// The files that the command new writes.
#pragma once

#include <span>
#include <string_view>

namespace mbsopt {

struct StarterFile {
  std::string_view kind;  // "pendulum"; a kind may have several
  std::string_view name;  // of the file
  std::string_view content;
};

std::span<const StarterFile> starter_files();

}  // namespace mbsopt
