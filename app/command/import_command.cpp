// Writes a model of another program as a problem file. It never overwrites an existing file.
#include <fmt/format.h>

#include <filesystem>

#include "app/files/atomic_file.hpp"
#include "app/import/import_model.hpp"
#include "app/run/command.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {

int import_command(const CommandContext& context) {
  namespace fs = std::filesystem;
  const ImportedProblem imported = import_model(context.options.problem_file);
  const fs::path folder = context.options.out;
  const fs::path path = folder / (imported.name + ".json");
  refuse_to_overwrite(path, "import");
  if (!folder.empty()) create_folder(folder);
  write_file_atomically(path, imported.text);
  context.out << fmt::format("{}: {}, {}\n", path.string(), counted(imported.bodies, "body", "bodies"),
                             counted(imported.joints, "joint"));
  for (const std::string& words : imported.warnings) context.out << "warning: " << words << '\n';
  for (const std::string& words : imported.changed) context.out << "changed: " << words << '\n';
  for (const std::string& words : imported.dropped) context.out << "dropped: " << words << '\n';
  context.out << fmt::format("try: mbsopt simulate {}\n", path.string());
  return kDone;
}

}  // namespace mbsopt::inline app
