// Words that begin with a path of the problem get its place in the file before them, as the reader's own findings have:
//
//   placed("drives[0].law: its samples ...", "crane.json", {})   "crane.json:41:18: drives[0].law: its samples ..."
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace mbsopt {

// Nothing where the words begin with no path, or the file cannot be read a second time. sets: of --set.
std::optional<std::string> placed(const std::string& words, const std::filesystem::path& file,
                                  const std::vector<std::string>& sets);

}  // namespace mbsopt
