#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "app/command/command_line.hpp"
#include "app/files/journal.hpp"
#include "app/json/source_text.hpp"
#include "app/run/command.hpp"
#include "app/run/output_folder.hpp"
#include "app/terminal/exit_code.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::pair<std::string_view, CommandFunction*> kResumable[] = {
    {"design", design_command}, {"identify", identify_command}, {"sweep", sweep_command}};

CommandFunction* resumable(std::string_view command) {
  for (const auto& [name, function] : kResumable)
    if (name == command) return function;
  return nullptr;
}

// The message of a failed run says what to change.
int nothing_left(const CommandContext& context, const StoredRun& run) {
  const std::filesystem::path folder = context.options.problem_file;
  context.out << fmt::format("{}: its '{}' is finished ({}); there is nothing to resume{}\n", folder.string(),
                             run.command, run.status, run.message.empty() ? "" : ": " + run.message);
  if (context.json) *context.json << read_text_file(folder / "result.json");
  return kDone;
}

}  // namespace

int resume_command(const CommandContext& context) {
  const std::filesystem::path folder = context.options.problem_file;
  StoredRun last = stored_run(folder);
  if (!resumable(last.command)) last = {};
  if (last.status == "ok" && !std::filesystem::exists(folder / kJournalFile))  // it was removed at the good end
    return nothing_left(context, last);
  const JournalContent journal = read_journal(folder);
  const std::vector<Json>& ends = journal.of("ended");
  if (!ends.empty() && last.status != "interrupted" && ends.back() == last.status) return nothing_left(context, last);
  const auto arguments = journal.header.at("arguments").get<std::vector<std::string>>();
  CommandOptions options = options_of(arguments);  // those of the run, except for the current folder
  options.threads = context.options.threads;
  options.quiet = context.options.quiet;
  const auto from_here = [&](const char* key) {
    return (folder / journal.header.at(key).get<std::string>()).lexically_normal().string();
  };
  options.problem_file = from_here("input");
  if (!options.sweep.points.empty()) options.sweep.points = from_here("points");
  options.allow_plugins = context.options.allow_plugins;  // a folder of somebody else's must not decide it
  options.out = folder.string();
  options.resume = true;
  CommandContext again = context;
  again.command = journal.header.value("command", "");
  again.arguments = arguments;
  again.options = options;
  if (CommandFunction* const command = resumable(again.command)) return command(again);
  throw std::invalid_argument(
      fmt::format("{}: belongs to '{}', which cannot be resumed", (folder / kJournalFile).string(), again.command));
}

}  // namespace mbsopt::inline app
