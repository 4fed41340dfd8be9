#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "app/command/starter_files.hpp"
#include "app/files/atomic_file.hpp"
#include "app/run/command.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/expression/did_you_mean.hpp"

namespace mbsopt {

// Writes all files of the kind, or none.
int new_command(const CommandContext& context) {
  const std::string& kind = context.options.problem_file;
  std::vector<StarterFile> files;
  std::vector<std::string> kinds;
  for (const StarterFile& file : starter_files()) {
    if (file.kind == kind) files.push_back(file);
    if (kinds.empty() || kinds.back() != file.kind) kinds.emplace_back(file.kind);
  }
  if (files.empty()) {
    context.err << fmt::format("mbsopt: there is no starter file of the kind '{}'{}; available: {}\n", kind,
                               did_you_mean(kind, kinds), joined(kinds));
    return kBadInput;
  }
  for (const StarterFile& file : files)
    if (std::filesystem::exists(std::filesystem::symlink_status(file.name)))
      throw OutputError(fmt::format(
          "{}: exists already, and new never replaces a file; move it, or go to another folder", file.name));
  for (const StarterFile& file : files) {
    write_file_atomically(file.name, file.content);
    context.out << fmt::format("wrote {}\n", file.name);
  }
  return kDone;
}

}  // namespace mbsopt
