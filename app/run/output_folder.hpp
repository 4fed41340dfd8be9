// The output folder of a run: --out DIR, or out/<problem's name>/. Its result.json names the owner, the path of the
// problem file relative to the folder. A run does not touch a folder that holds anything of another problem. No other
// command replaces the outcome of a design or an identification, which may have taken hours.
//
//   OutputFolder folder("", problem.name, "problems/five_bar/design.json", "design");   // throws OutputError
//   const auto lock = folder.claim();                                                    // from here on it is ours
//   folder.write("trajectory.csv", text);
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "app/files/folder_lock.hpp"

namespace mbsopt::inline app {

// The problem, the command and the status of a result.json; empty if this program has not written it.
struct StoredRun {
  std::string owner, command, status, message;
};
StoredRun stored_run(const std::filesystem::path& folder);

class OutputFolder {
 public:
  // Creates the folder if necessary.
  OutputFolder(const std::string& requested, const std::string& problem_name, const std::string& problem_file,
               const std::string& command);

  const std::filesystem::path& path() const { return path_; }
  const std::string& owner() const { return owner_; }  // provenance.input in result.json
  // Locks the folder, made anew if it was deleted, and removes unfinished files of a killed run. Throws OutputError if
  // another command writes into it, or has done so since.
  std::unique_ptr<FolderLock> claim() const;
  void write(const std::string& file, std::string_view content) const;
  // Changes "running" in result.json to "failed" without a further byte, when nothing can be written any more.
  void mark_failed() const noexcept;

 private:
  void refuse_if_taken() const;
  std::filesystem::path path_;
  std::string owner_, command_;
};

}  // namespace mbsopt::inline app
