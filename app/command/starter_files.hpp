// Problem files to start from, one per kind of task, with comments on what to change. `mbsopt new` writes them.
#pragma once

#include <span>
#include <string_view>

namespace mbsopt::inline app {

struct StarterFile {
  std::string_view name, text;
};
struct Starter {
  std::string_view kind;
  std::string_view next;               // the command to try first
  std::span<const StarterFile> files;  // the problem file, then its data
};

std::span<const Starter> starters();

}  // namespace mbsopt::inline app
