// The folder a run writes into: --out DIR, or out/<problem's name>/. Its result.json says whose it is (the path of the
// problem file seen from the folder); a folder that holds anything of another problem is left untouched. So is the
// outcome of a design or an identification, which may have taken hours, by any other command.
//
//   OutputFolder folder("", problem.name, "problems/five_bar/design.json", "design");   // throws OutputError
//   folder.write("trajectory.csv", text);
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mbsopt {

class OutputFolder {
 public:
  // Creates the folder where needed.
  OutputFolder(const std::string& requested, const std::string& problem_name, const std::string& problem_file,
               const std::string& command);

  const std::filesystem::path& path() const { return path_; }
  const std::string& owner() const { return owner_; }  // what result.json stores as provenance.input
  void write(const std::string& file, std::string_view content) const;

 private:
  void refuse_if_taken(const std::string& command) const;
  std::filesystem::path path_;
  std::string owner_;
};

}  // namespace mbsopt
