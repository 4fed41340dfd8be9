// The problem files of problems/, by name: "joints/gear_train", ...
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "source_folder.hpp"

namespace mbsopt::testing {

inline const std::filesystem::path kProblems = std::filesystem::path(MBSOPT_SOURCE_DIR) / "problems";

inline std::vector<std::string> gallery() {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(kProblems)) {
    if (entry.path().extension() == ".json" && entry.path().parent_path() != kProblems)
      names.push_back(fs::relative(entry.path(), kProblems).replace_extension().generic_string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

inline std::filesystem::path file_of(const std::string& name) { return kProblems / (name + ".json"); }

}  // namespace mbsopt::testing
