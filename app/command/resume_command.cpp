#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "app/command/command_line.hpp"
#include "app/files/journal.hpp"
#include "app/files/json_text.hpp"
#include "app/json/source_text.hpp"
#include "app/run/command.hpp"
#include "app/terminal/exit_code.hpp"

namespace mbsopt::inline app {
namespace {

int nothing_left(const CommandContext& context, const std::string& command, const std::string& ended) {
  const std::filesystem::path folder = context.options.problem_file;
  const std::string result = read_text_file(folder / "result.json");
  const std::string message = read_json(result).value("message", "");  // of a failed run, with what to change
  context.out << fmt::format("{}: its '{}' is finished ({}); there is nothing to resume{}\n", folder.string(), command,
                             ended, message.empty() ? "" : ": " + message);
  if (context.json) *context.json << result;
  return kDone;
}

struct LastRun {
  std::string command, status;
};

// Reads command and status of a run that can be resumed from result.json; both are empty if there was none.
LastRun last_run(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "result.json")) return {};
  const Json result = read_json_or_discarded(read_text_file(folder / "result.json"));
  const auto text = [&](const char* key) {
    return result.is_object() && result.contains(key) && result[key].is_string() ? result[key].get<std::string>() : "";
  };
  const std::string command = text("command");
  const bool resumes = command == "design" || command == "identify" || command == "sweep";
  return text("program") == "mbsopt" && resumes ? LastRun{command, text("status")} : LastRun{};
}

}  // namespace

int resume_command(const CommandContext& context) {
  const std::filesystem::path folder = context.options.problem_file;
  const LastRun last = last_run(folder);
  if (last.status == "ok" && !std::filesystem::exists(folder / kJournalFile))  // it was removed at the good end
    return nothing_left(context, last.command, last.status);
  const JournalContent journal = read_journal(folder);
  const std::string command = journal.header.value("command", "");
  if (!journal.ended.empty() && journal.ended != "interrupted" && journal.ended == last.status)
    return nothing_left(context, command, journal.ended);
  const auto arguments = journal.header.at("arguments").get<std::vector<std::string>>();
  CommandOptions options = options_of(arguments);  // those of the run, except for the current folder
  options.threads = context.options.threads, options.quiet = context.options.quiet;
  const auto from_here = [&](const char* key) {
    return (folder / journal.header.at(key).get<std::string>()).lexically_normal().string();
  };
  options.problem_file = from_here("input");
  if (!options.sweep.points.empty()) options.sweep.points = from_here("points");
  if (!options.compare.empty()) options.compare = from_here("compare");
  options.allow_plugins = context.options.allow_plugins;  // a folder of somebody else's must not decide it
  options.out = folder.string();
  options.resume = true;
  CommandContext again = context;
  again.command = command, again.arguments = arguments, again.options = options;
  if (command == "design") return design_command(again);
  if (command == "identify") return identify_command(again);
  if (command == "sweep") return sweep_command(again);
  throw std::invalid_argument(
      fmt::format("{}: belongs to '{}', which cannot be resumed", (folder / kJournalFile).string(), command));
}

}  // namespace mbsopt::inline app
