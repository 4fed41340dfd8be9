// Writes a starter file and its data. If one of the files exists, it writes nothing.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "app/command/starter_files.hpp"
#include "app/files/atomic_file.hpp"
#include "app/run/command.hpp"
#include "app/terminal/exit_code.hpp"

namespace mbsopt::inline app {

int new_command(const CommandContext& context) {
  namespace fs = std::filesystem;
  const auto starter = std::ranges::find(starters(), context.options.starter, &Starter::kind);
  if (starter == starters().end())
    throw std::invalid_argument(fmt::format("there is no starter '{}'", context.options.starter));
  const fs::path folder = context.options.out;
  for (const StarterFile& file : starter->files) refuse_to_overwrite(folder / file.name, "new");
  if (!folder.empty()) create_folder(folder);
  for (const StarterFile& file : starter->files) write_file_atomically(folder / file.name, file.text);
  const auto path_of = [&](const StarterFile& file) { return (folder / file.name).string(); };
  for (const StarterFile& file : starter->files) context.out << path_of(file) << '\n';
  context.out << fmt::format("try: mbsopt {} {}\n", starter->next, path_of(starter->files.front()));
  return kDone;
}

}  // namespace mbsopt::inline app
