// The folder a run writes into: --out DIR, or out/<problem's name>/. Its result.json says whose it is (the path of the
// problem file seen from the folder); a folder that holds anything of another problem is left untouched. So is the
// outcome of a design or an identification, which may have taken hours, by any other command.
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

namespace mbsopt {

class OutputFolder {
 public:
  // Creates the folder where needed.
  OutputFolder(const std::string& requested, const std::string& problem_name, const std::string& problem_file,
               const std::string& command);

  const std::filesystem::path& path() const { return path_; }
  const std::string& owner() const { return owner_; }  // what result.json stores as provenance.input
  // Locks the folder and removes what a killed run left of unfinished files. Throws OutputError where another command
  // writes into it, or has done so since.
  std::unique_ptr<FolderLock> claim() const;
  void write(const std::string& file, std::string_view content) const;
  // For when nothing can be written any more: "running" in result.json becomes "failed" without a further byte.
  void mark_failed() const noexcept;

 private:
  void refuse_if_taken() const;
  std::filesystem::path path_;
  std::string owner_, command_;
};

}  // namespace mbsopt
