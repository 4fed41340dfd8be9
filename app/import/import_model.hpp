// Turns URDF or MJCF into a problem file.
//
//   const ImportedProblem imported = import_model("arm.urdf");     // throws InputError: what is wrong, with its line
//   imported.text                                                  // of arm.json
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mbsopt::inline app {

struct ImportedProblem {
  std::string name;                   // the model's name, used for the file
  std::string text = {};              // the problem file; its comments contain the lists, too
  std::vector<std::string> changed;   // changed content, in sentences
  std::vector<std::string> warnings;  // why simulate fails: bodies without mass that no joint holds
  std::vector<std::string> dropped;   // omitted parts: "line 12: joint range"
  std::size_t bodies = 0, joints = 0;
};

ImportedProblem import_model(const std::filesystem::path& model);

// Reads the same from a text, without warnings: it assembles no mechanism. `model` names the file in findings.
ImportedProblem read_model_text(const std::string& text, const std::filesystem::path& model);

}  // namespace mbsopt::inline app
