#include "app/run/output_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "app/files/atomic_file.hpp"
#include "app/files/journal.hpp"
#include "app/files/json_text.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline app {
namespace fs = std::filesystem;
namespace {

// journal.jsonl is not among them: the journal itself replaces no foreign file (journal.hpp).
constexpr std::array kOutputs{"result.json", "trajectory.csv", "drives.csv",   "report.html",      "optimized.json",
                              "history.csv", "residuals.csv",  "tradeoff.csv", "recommended.json", "sweep.csv"};

// Makes a folder's name from a problem's: no separators, no leading dot, no control characters.
std::string folder_name(std::string name) {
  for (char& c : name) {
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20) c = '_';
  }
  if (name.empty() || name.front() == '.') name.insert(name.begin(), '_');
  return name;
}

std::string text_at(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string{};
}

// Call this only with the folder's lock: the parts may belong to a running command.
void remove_parts(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const auto is_part = [&](const char* output) { return is_part_of(name, output); };
    if (is_part(kJournalFile) || std::any_of(kOutputs.begin(), kOutputs.end(), is_part))
      fs::remove(entry.path(), ignored);
  }
}

}  // namespace

StoredRun stored_run(const fs::path& folder) {
  Json result;
  try {
    result = read_json_or_discarded(content_of_regular_file(folder / "result.json"));
  } catch (const FileError&) {
    return {};
  }
  if (text_at(result, "program") != "mbsopt" || !result.contains("provenance")) return {};
  return {text_at(result.at("provenance"), "input"), text_at(result, "command"), text_at(result, "status"),
          text_at(result, "message")};
}

OutputFolder::OutputFolder(const std::string& requested, const std::string& problem_name,
                           const std::string& problem_file, const std::string& command)
    : path_(requested.empty() ? fs::path("out") / folder_name(problem_name) : fs::path(requested)), command_(command) {
  create_folder(path_);
  owner_ = fs::relative(fs::canonical(problem_file), fs::canonical(path_)).generic_string();
  refuse_if_taken();
}

std::unique_ptr<FolderLock> OutputFolder::claim() const {
  create_folder(path_);
  auto lock = std::make_unique<FolderLock>(path_);
  refuse_if_taken();
  if (lock->held()) remove_parts(path_);
  return lock;
}

void OutputFolder::refuse_if_taken() const {
  const StoredRun stored = stored_run(path_);
  if (stored.owner == owner_) {
    const bool costly = stored.command == "design" || stored.command == "identify";
    if (!costly || stored.command == command_ || !fs::exists(path_ / "optimized.json")) return;
    throw OutputError(fmt::format(
        "{0}: holds the outcome of '{1}', which '{2}' would overwrite; name another folder with --out, such as --out "
        "{3}, or remove this one",
        path_.string(), stored.command, command_,
        (path_.parent_path() / (path_.filename().string() + "_" + command_)).string()));
  }
  if (!stored.owner.empty()) {
    throw OutputError(fmt::format(
        "{}: holds the results of another problem ({}); they are never overwritten: name another folder with --out, or "
        "remove this one",
        path_.string(), (path_ / stored.owner).lexically_normal().string()));
  }
  for (const char* name : kOutputs) {
    if (fs::exists(path_ / name)) {
      throw OutputError(fmt::format("{}: holds a {} that no run of this problem wrote; name another folder with --out",
                                    path_.string(), name));
    }
  }
}

void OutputFolder::write(const std::string& file, std::string_view content) const {
  write_file_atomically(path_ / file, content);
}

void OutputFolder::mark_failed() const noexcept {
  constexpr std::string_view running = R"("status": "running")", failed = R"("status": "failed" )";
  static_assert(running.size() == failed.size());
  const int descriptor = ::open((path_ / "result.json").c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) return;
  std::array<char, 4096> begin;  // the status is one of the first keys
  const ssize_t count = ::read(descriptor, begin.data(), begin.size());
  const std::string_view text(begin.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  if (const std::size_t at = text.find(running); at != std::string_view::npos) [[maybe_unused]]
    const ssize_t written = ::pwrite(descriptor, failed.data(), failed.size(), static_cast<off_t>(at));
  ::close(descriptor);
}

}  // namespace mbsopt::inline app
